"""Benchmarks: the SQP step beside acados, the parts of a control step, and whole flights in one process."""
