"""Text of forecasts, as a whole, as rows of tables, and as JSON."""
