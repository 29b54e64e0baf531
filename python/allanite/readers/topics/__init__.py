"""Logs that have topics: ROS bags, ULog, ArduPilot.

Input: a path, and the name of a topic. Output: a `Table` of this topic. Add a format as a module with `read(path,
pick)`, isolated in a child process, and `FORMAT`.
"""
