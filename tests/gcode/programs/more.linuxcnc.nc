%
(three spindles)
G21 G90 G17 G54 F100
G0 X0 Y0 Z5
M3 S500 $1
M5 $1
M3 S100 $0
S200
G96 D1000 S50
G1 X1
G97 S300
G95 F0.1 G1 X2
G93 G1 X3 F2
G94 F100
G43
T3 M6
G43
G43 H4
G43.1 Z1 X2
G49
G41 D1 G1 X5
G1 Y5
G42 D2
G40 G1 X9
G54.1
G59.1
G53 G1 X1 Z1 F50
G28 X1 Y1
G30
G28.1
G92 X1 Y1 Z1
G92.2
G92.3
G10 L1 P1 R1
G10 L2 P0 X1
G10 L20 P1 Z0
M7 M8
M9
M19 R90
M60
M1
M61 Q5
M63 P1
M67 E1 Q2
M66 E1 L0
M99
%
-----
G21 G90 F100
#1=5
#<name>=#1
G0 X0 Y0 Z0
G1 X[#<name>*2] Y[SIN[90]]
#5420=3
G1 X[#<_x>+1]
o<sub> sub
G1 Z#1
o<sub> return [#1+1]
o<sub> endsub
o<sub> call [7] [8]
G1 Z#<_value>
(print,#1)
(LOG,x)
(PROBEOPEN a.txt)
(PROBECLOSE)
;py,foo
o10 if [EXISTS[#<_z>]]
G1 X1
o10 else
G1 X2
o10 endif
o11 do
#1=[#1-1]
o11 while [#1 GT 3]
G1 X#1
M2
-----
o1 if [1]
M2
-----
o1 endif
M2
-----
G21
o1 while [#<x> GT 1]
o1 endwhile
M2
-----
G21
G1 X[1/0] F1
M2
-----
G21
#<_hal[a]>=1
M2
-----
G21 G90
G1 X1 F
M2
-----
G21 Q
M2
