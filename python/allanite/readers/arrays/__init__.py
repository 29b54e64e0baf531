"""Files of named arrays: MATLAB, HDF5, netCDF, NumPy, Parquet and Arrow.

Input: a path and a choice of columns. Output: a `Table`. Add a format as a module with `read(path, pick)` and
`FORMAT`.
"""
