"""Measurements that aid the inertial filter: a module for each kind of sensor."""
