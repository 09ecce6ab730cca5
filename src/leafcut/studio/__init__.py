"""The local web page of leafcut. It opens files, shows the drawing, runs jobs, and provides the finished program."""
