"""Results of gates in the formats that CI systems read."""
