"""The server of the studio: who may come in, what is asked for by address, and how it begins and ends."""
