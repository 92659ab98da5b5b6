"""Pre-test planning on a structure: candidates on the mesh, sensors, shaker, cords, test time."""

from .places import Places as Places
from .places import find_places as find_places
from .plan import Plan as Plan
from .plan import Wishes as Wishes
from .plan import plan as plan
from .summary import sensors_csv as sensors_csv
from .summary import summary as summary
