"""Connections: how many are held at one time, and how long one may take to send a request."""
