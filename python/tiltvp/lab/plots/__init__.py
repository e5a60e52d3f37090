"""Pictures: table or image in, figure or image out."""
