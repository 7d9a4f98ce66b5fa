"""What only ground stations use and no flight needs: files (FTP), logs, events, metadata, remote id, a shell."""
