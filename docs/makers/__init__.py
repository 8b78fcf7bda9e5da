"""What makes the pages of docs/reference, each from the thing itself."""
