"""What goes out to other people's servers: where it may go, and when it is tried again."""
