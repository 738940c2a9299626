"""The mathematics behind the answers of the catalogue. Nothing here knows Potto."""
