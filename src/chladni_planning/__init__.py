"""Pre-test planning on a structure: candidates on the mesh, sensors, shaker, cords, test time."""

from chladni.ema.correlation import auto_mac as auto_mac
from chladni.workflows.place_words import labels_not_allowed as labels_not_allowed

from . import plan_views as plan_views
from .actuator_ranking import ActuatorRanking as ActuatorRanking
from .actuator_ranking import Shaking as Shaking
from .actuator_ranking import best_actuators as best_actuators
from .actuator_ranking import driving_point_residue as driving_point_residue
from .actuator_ranking import ranked_actuators as ranked_actuators
from .actuator_ranking import rattle_margin as rattle_margin
from .actuator_ranking import shaking as shaking
from .gramians import Balanced as Balanced
from .gramians import balanced as balanced
from .gramians import condition as condition
from .gramians import controllability_gramian as controllability_gramian
from .gramians import gramian_quotient as gramian_quotient
from .gramians import gramians as gramians
from .gramians import hankel_values as hankel_values
from .gramians import modal_rank as modal_rank
from .gramians import observability_gramian as observability_gramian
from .layouts.deletion import Deletion as Deletion
from .layouts.deletion import deletion as deletion
from .layouts.deletion import effective_independence as effective_independence
from .layouts.deletion import first_max as first_max
from .layouts.deletion import first_min as first_min
from .layouts.deletion import greedy as greedy
from .layouts.deletion import qr_ranking as qr_ranking
from .layouts.distinct import distinct as distinct
from .layouts.distinct import excess as excess
from .layouts.distinct import likeness as likeness
from .layouts.exchange import best_layout as best_layout
from .layouts.exchange import exchange as exchange
from .layouts.information import Candidates as Candidates
from .layouts.information import candidates as candidates
from .layouts.information import expected_posterior as expected_posterior
from .layouts.information import independence as independence
from .layouts.information import information_entropy as information_entropy
from .layouts.information import log_det_fisher as log_det_fisher
from .layouts.information import sensitivity_rows as sensitivity_rows
from .layouts.information import value as value
from .layouts.layout_quality import Move as Move
from .layouts.layout_quality import kinetic_energy as kinetic_energy
from .layouts.layout_quality import loaded_frequency as loaded_frequency
from .layouts.layout_quality import overlap as overlap
from .layouts.layout_quality import visibility as visibility
from .layouts.layout_quality import with_visible_modes as with_visible_modes
from .layouts.layout_rules import Rules as Rules
from .layouts.layout_rules import too_near as too_near
from .layouts.layout_search import evolved as evolved
from .layouts.layout_walk import Walk as Walk
from .layouts.separation import separating as separating
from .measurement_lines import burst_random_time as burst_random_time
from .measurement_lines import delay_at as delay_at
from .measurement_lines import delay_cycles as delay_cycles
from .measurement_lines import even_lines as even_lines
from .measurement_lines import half_bandwidth as half_bandwidth
from .measurement_lines import lines_for_poles as lines_for_poles
from .measurement_lines import lines_per_bandwidth as lines_per_bandwidth
from .measurement_lines import lines_time as lines_time
from .measurement_lines import transient_left as transient_left
from .mounts import mounts_at as mounts_at
from .mounts import seen_at as seen_at
from .parameter_information import Linearised as Linearised
from .plan_summary import sensors_csv as sensors_csv
from .plan_summary import summary as summary
from .plan_workflow import plan as plan
from .plan_workflow import with_places_of as with_places_of
from .rattle import openings as openings
from .sensor_candidates import SensorCandidates as SensorCandidates
from .sensor_candidates import find_sensor_candidates as find_sensor_candidates
from .whole_plan import Plan as Plan
from .whole_plan import PlanSettings as PlanSettings
from .whole_plan import motion as motion
from .whole_plan import plan_test as plan_test
from .whole_plan import target_modes as target_modes

__all__ = [
    "ActuatorRanking",
    "Balanced",
    "Candidates",
    "Deletion",
    "Linearised",
    "Move",
    "Plan",
    "PlanSettings",
    "Rules",
    "SensorCandidates",
    "Shaking",
    "Walk",
    "auto_mac",
    "balanced",
    "best_actuators",
    "best_layout",
    "burst_random_time",
    "candidates",
    "condition",
    "controllability_gramian",
    "delay_at",
    "delay_cycles",
    "deletion",
    "distinct",
    "driving_point_residue",
    "effective_independence",
    "even_lines",
    "evolved",
    "excess",
    "exchange",
    "expected_posterior",
    "find_sensor_candidates",
    "first_max",
    "first_min",
    "gramian_quotient",
    "gramians",
    "greedy",
    "half_bandwidth",
    "hankel_values",
    "independence",
    "information_entropy",
    "kinetic_energy",
    "labels_not_allowed",
    "likeness",
    "lines_for_poles",
    "lines_per_bandwidth",
    "lines_time",
    "loaded_frequency",
    "log_det_fisher",
    "modal_rank",
    "motion",
    "mounts_at",
    "observability_gramian",
    "openings",
    "overlap",
    "plan",
    "plan_test",
    "qr_ranking",
    "ranked_actuators",
    "rattle_margin",
    "seen_at",
    "sensitivity_rows",
    "sensors_csv",
    "separating",
    "shaking",
    "summary",
    "target_modes",
    "too_near",
    "transient_left",
    "value",
    "visibility",
    "with_places_of",
    "with_visible_modes",
]
