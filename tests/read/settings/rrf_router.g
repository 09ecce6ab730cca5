; config.g of a router with a Duet 2
M550 P"OX router"                     ; name
M453                                  ; CNC mode
M584 X0 Y1:3 Z2                       ; two motors on Y
M669 K0
M350 X16 Y16:16 Z16 I1
M92 X26.667 Y26.667:26.667 Z400
M566 X900.00 Y900.00:900.00 Z60.00    ; jerk, mm/min
M203 X15000.00 Y12000.00:12000.00 Z2000.00 ; speeds, mm/min
M201 X500.00 Y400.00:400.00 Z150.00   ; mm/s^2
M208 X0:770 Y0:745 Z-10:85
M950 R0 C"exp.heater3" L24000
