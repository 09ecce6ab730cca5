M569 P0 S1
M569 P1 S1
M569 P2 S1
M584 X0 Y1 Z2
M350 X{global.motorMicroSteps} Y{global.motorMicroSteps} Z{global.motorMicroSteps} I0
var stepsPerMM = {((360 / global.motorStepDegrees) / global.leadScrewPitch) * global.motorMicroSteps}
M92 X{var.stepsPerMM} Y{var.stepsPerMM} Z{var.stepsPerMM * 2}
M906 X{global.motorCurrentLimitX} Y{global.motorCurrentLimitY} Z{global.motorCurrentLimitZ}
M84
