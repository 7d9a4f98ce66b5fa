"""The mission editor: open documents, and the page's interface to them."""
