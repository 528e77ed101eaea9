"""run_lanes"""
