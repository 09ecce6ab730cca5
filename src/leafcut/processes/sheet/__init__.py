"""Sheet cutting: convert the contours of a drawing to a cutting program for plasma, laser, oxyfuel or water jet."""
