; the older way to say limits
G21
M550 PWorkshop
M555 P2
M201 X800 Y800 Z15 E1000            ; Accelerations (mm/s^2)
M203 X15000 Y15000 Z100 E3600       ; Maximum speeds (mm/min)
M566 X600 Y600 Z30 E20              ; Minimum speeds mm/minute
M208 X214 Y210 Z120 S0              ; axis maximum
M208 X-18 Y0 Z0 S1                  ; axis minimum
