"""A board of KiCad, run by the Python that has its module: five plated holes and two others, as drill files."""

import sys

import pcbnew

board, mm = pcbnew.BOARD(), pcbnew.FromMM
point = getattr(pcbnew, "wxPoint", None) or pcbnew.VECTOR2I
for x, y in ((20, 20), (60, 20), (60, 50), (20, 50), (40, 35)):
    via = pcbnew.PCB_VIA(board)
    via.SetPosition(point(mm(x), mm(y)))
    via.SetDrill(mm(0.8))
    via.SetWidth(mm(1.6))
    board.Add(via)
footprint = pcbnew.FOOTPRINT(board)
for x in (25, 55):
    pad = pcbnew.PAD(footprint)
    pad.SetAttribute(pcbnew.PAD_ATTRIB_NPTH)
    pad.SetShape(pcbnew.PAD_SHAPE_CIRCLE)
    size = getattr(pcbnew, "wxSize", None) or pcbnew.VECTOR2I
    pad.SetSize(size(mm(3.2), mm(3.2)))
    pad.SetDrillSize(size(mm(3.2), mm(3.2)))
    pad.SetPosition(point(mm(x), mm(35)))
    pad.SetLayerSet(pad.UnplatedHoleMask())
    footprint.Add(pad)
board.Add(footprint)
writer = pcbnew.EXCELLON_WRITER(board)
writer.SetFormat(True)
writer.SetOptions(False, False, point(0, 0), False)
writer.CreateDrillandMapFilesSet(sys.argv[1], True, False)
