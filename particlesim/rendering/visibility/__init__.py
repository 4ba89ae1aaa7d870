"""What each pixel sees, found before anything is drawn."""
