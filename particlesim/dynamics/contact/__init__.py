"""What becomes of contacts: impulses at impacts, and what rests."""
