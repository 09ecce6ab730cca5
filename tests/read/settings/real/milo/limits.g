M208 X{global.xMin} Y{global.yMin} Z{global.zMin} S1
M208 X{global.xMax} Y{global.yMax} Z{global.zMax} S0
M574 X1 S1 P"^xstop"
M574 Y2 S1 P"^ystop"
M574 Z2 S1 P"^zstop"
M558 K0 P0
