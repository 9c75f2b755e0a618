"""Host names and logging that all servers of KBot share."""
