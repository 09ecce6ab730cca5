"""Local web page of leafcut: opens a file, shows the drawing, runs jobs and delivers the program."""
