"""Names of machines, and the log of servers: what every server of KBot has in common."""
