"""Statistics of estimates: covariance, gauges, profiles, intervals, verdicts."""
