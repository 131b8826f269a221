"""The monitor: pages in the browser that show runs, data and training, also while they run.

It reads directories and writes none, but for the runs that a person plays. Nothing else imports it.
"""
