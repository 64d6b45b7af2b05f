"""Files on their way between the blob store and where other people keep theirs."""
