"""Logs that have topics: ROS bags, ULog, ArduPilot."""
