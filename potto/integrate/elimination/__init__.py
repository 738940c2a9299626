"""Many variables, integrated out one after the other as functions of one number."""
