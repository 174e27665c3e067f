"""Path tracing: light that is scattered many times, as the reference for all cheaper light."""
