"""Work-precision benchmarks: one job for everybody, judged by the 50-digit reference. `make bench` runs them.

The job: touchdown state and a constant current in; take-off time and state, all events with their times, and the AED
out, with the hold rule, slips, reversals and stops. jobs.py draws it, truth.py solves it to 50 digits,
tests/oracle/rules.py and peers/rules.h are the mode logic that every peer shares, scipy_peers.py, numba_peer.py
and peers/ are the peers, rows.py lists them with hopform's rows, verdicts.py counts wrong event lists, report.py writes
what came out.
"""
