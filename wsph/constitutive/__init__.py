"""Any material in any stress state."""
