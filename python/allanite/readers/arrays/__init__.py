"""Files of named arrays: MATLAB, HDF5, netCDF."""
