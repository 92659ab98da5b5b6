"""Generated structures: plates, panels, the open tailgate; their mesher and their joints."""

from .formed_panel import formed_panel as formed_panel
from .forms import FORMS as FORMS
from .forms import DrawnForm as DrawnForm
from .forms.mesh_pieces import Piece as Piece
from .forms.mesh_pieces import of_pieces as of_pieces
from .forms.mesh_pieces import rectangle as rectangle
from .forms.mesh_pieces import stops as stops
from .forms.tube_frame import tube_frame as tube_frame
from .holed_plate import holed_plate as holed_plate
from .jointed_plates import bushed_plates as bushed_plates
from .jointed_plates import jointed_plates as jointed_plates
from .jointed_plates import tied_plates as tied_plates
from .joints.bolts import grip as grip
from .joints.bolts import screw as screw
from .joints.builders import STEEL as STEEL
from .joints.builders import adhesive_bead as adhesive_bead
from .joints.builders import spot_welds as spot_welds
from .plates import box as box
from .plates import folded_panel as folded_panel
from .plates import plate as plate
from .plates import solid_plate as solid_plate
from .tailgate.design import TailgateDesign as TailgateDesign
from .tailgate.formed_thickness import forming_mesh as forming_mesh
from .tailgate.skin import Skin as Skin
from .tailgate.tailgate import FormedSpecimen as FormedSpecimen
from .tailgate.tailgate import tailgate as tailgate
from .tailgate.tailgate import tailgate_specimen as tailgate_specimen

__all__ = [
    "FORMS",
    "STEEL",
    "DrawnForm",
    "FormedSpecimen",
    "Piece",
    "Skin",
    "TailgateDesign",
    "adhesive_bead",
    "box",
    "bushed_plates",
    "folded_panel",
    "formed_panel",
    "forming_mesh",
    "grip",
    "holed_plate",
    "jointed_plates",
    "of_pieces",
    "plate",
    "rectangle",
    "screw",
    "solid_plate",
    "spot_welds",
    "stops",
    "tailgate",
    "tailgate_specimen",
    "tied_plates",
    "tube_frame",
]
