"""What only ground stations use and no flight needs: files, logs, events, metadata, remote id, a shell."""
