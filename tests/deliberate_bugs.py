"""Deliberate bugs: each is a few characters of the source, and the tests of its room must fail."""

from typing import NamedTuple


class DeliberateBug(NamedTuple):
    """A text of a file, which stands there once, what it becomes, and the tests that must fail."""

    file: str
    old: str
    new: str
    tests: str


BUGS = (
    DeliberateBug(  # the weight of masses is lost in densities
        "src/chladni/units.py", "self.inertia / self.length**3", "self.mass / self.length**3",
        "tests/formats/nastran",
    ),
    DeliberateBug(  # frequencies spread away from the ends in place of towards them
        "src/chladni/model/following_frequencies.py", "** (1 / self.cluster)", "** self.cluster",
        "tests/model",
    ),
    DeliberateBug(  # curvature of a cylinder from its flat direction
        "src/chladni/geometry/curvature.py", "np.abs(values).argmax", "np.abs(values).argmin",
        "tests/geometry",
    ),
    DeliberateBug(  # negative and positive eigenvalues change places
        "src/chladni/sparse/factor.py", "return negative, A.shape[0] - negative",
        "return A.shape[0] - negative, negative", "tests/sparse",
    ),
    DeliberateBug(  # structural damping counted as a fraction of critical
        "src/chladni/dynamics/damping.py", '"g": y / 2', '"g": y', "tests/dynamics",
    ),
    DeliberateBug(  # poles of one peak are told apart at any distance
        "src/chladni/ema/coincident_poles.py", "residues[first] += residues[twins].sum(axis=0)",
        "residues[first] += 0 * residues[twins].sum(axis=0)", "tests/ema/test_coincident_poles.py",
    ),
    DeliberateBug(  # a blank field is zero whatever its default
        "src/chladni/io/nastran/text/numbers.py",
        "return np.where(empty, blank, values), bad\n\n\ndef integers",
        "return values, bad\n\n\ndef integers", "tests/formats/nastran",
    ),
    DeliberateBug(  # a velocity is written as an acceleration
        "src/chladni/io/uff/write_uff.py", '"mobility": Axis(11,', '"mobility": Axis(12,',
        "tests/formats/test_uff.py",
    ),
    DeliberateBug(  # the arm of a bush turns the wrong way
        "src/chladni/fem/spring.py", "= -joined * turned", "= joined * turned",
        "tests/fem/test_spring.py",
    ),
    DeliberateBug(  # bars of a lossy material have no losses
        "src/chladni/fem/assemble.py", "_lossy(beam.loss_factors(assembly), K_e",
        "_lossy(0 * beam.loss_factors(assembly), K_e", "tests/fem/test_solve.py",
    ),
    DeliberateBug(  # losses of a bush go one field too far
        "src/chladni/io/nastran/edit/joint_changes.py", "key + 1 + k: v for", "key + 2 + k: v for",
        "tests/formats/nastran/test_joint_changes.py",
    ),
    DeliberateBug(  # Poisson's ratio of a grain is a thousandth off where it stands
        "src/chladni/io/nastran/edit/model_changes.py", 'names["nu12"] = ("NU12", 1.0)',
        'names["nu12"] = ("NU12", 1.001)', "tests/formats/nastran/test_model_changes.py",
    ),
    DeliberateBug(  # the mass is written at the grid, its offset is lost
        "src/chladni/effects/masses.py", "(grid,), m, offset)", "(grid,), m)",
        "tests/effects/test_contract.py",
    ),
    DeliberateBug(  # the place of a moved mass is mirrored at its grid
        "src/chladni/effects/masses.py", "offset = self.written_at(assembly, x) - assembly",
        "offset = -self.written_at(assembly, x) + assembly", "tests/effects/test_contract.py",
    ),
    DeliberateBug(  # springs along a hem hold half of what they should
        "src/chladni/effects/hems.py", "self.parameters[0].value(x[0]) * self.line.share * w",
        "0.5 * self.parameters[0].value(x[0]) * self.line.share * w", "tests/effects/test_hem.py",
    ),
    DeliberateBug(  # the card of a support has the nominal stiffness, not the fitted one
        "src/chladni/effects/springs.py", "k, d = self.parameters[0].value(x[0]), self.pushes(x)",
        "k, d = self.parameters[0].value(0.0), self.pushes(x)", "tests/effects/test_contract.py",
    ),
    DeliberateBug(  # a slope of the moved place in metres, not in units of the patch
        "src/chladni/effects/attachments.py", "self.patch.slope(at, k) * size for k",
        "self.patch.slope(at, k) for k", "tests/effects/test_contract.py",
    ),
    DeliberateBug(  # half of the gain that a name costs
        "src/chladni/search/decision_rules.py", "return 2 * math.log(tried / chance)",
        "return math.log(tried / chance)", "tests/search/test_decide.py",
    ),
    DeliberateBug(  # soft modes beside a stiff part are off by the shift
        "src/chladni/reduced/real_modes.py", "return 1 / mu - shift,", "return 1 / mu,",
        "tests/reduced/test_real_modes.py",
    ),
    DeliberateBug(  # bending grows with t in place of t³
        "src/chladni/reduced/field_factors.py", 'fields["E"] + power * fields["t"]',
        'fields["E"] + fields["t"]', "tests/effects/test_contract.py",
    ),
    DeliberateBug(  # the weighing pulls at every parameter with its full sd
        "src/chladni/inference/map_fit.py", "J.append(state.dweight[None] / mass_measurement.sd)",
        "J.append(state.dweight[None])", "tests/inference/test_map_fit.py",
    ),
    DeliberateBug(  # a thicker sheet is as much stiffer as it is heavier
        "src/chladni/search/compensation.py", '"E": 1.0, "t": 3.0', '"E": 3.0, "t": 1.0',
        "tests/search/test_calibration.py",
    ),
    DeliberateBug(  # of a silent drive and a silent sensor each is taken for the other
        "src/chladni/search/silent_dofs.py", "silent.all(axis=0), silent.all(axis=1)",
        "silent.all(axis=1), silent.all(axis=0)", "tests/search/test_silent_dofs.py",
    ),
    DeliberateBug(  # a recording is mended, and nothing says so
        "src/chladni/workflows/mended_case.py",
        "mended, (*faults, *(f for f in found.screening.faults if f.mend))", "mended, faults",
        "tests/workflows/test_mended_case.py",
    ),
    DeliberateBug(  # variances of noise taken for its deviations
        "src/chladni_planning/layouts/information.py", "rows / np.sqrt(noise)[:, None, None]",
        "rows / noise[:, None, None]", "tests/planning/test_layouts.py",
    ),
    DeliberateBug(  # a band is taken as it is asked for, whatever the recording covers
        "src/chladni/case/bands.py", "max(band[0], float(f[0]))", "float(band[0])", "tests/case",
    ),
    DeliberateBug(  # an effect stays that moved farther than both places are known
        "src/chladni/workflows/effects_by_state.py", "if away <= known", "if away >= known",
        "tests/workflows/test_effects_by_state.py",
    ),
    DeliberateBug(  # of every block of lines the highest is lost
        "src/chladni/view/chart_page.py", "in (np.argmin, np.argmax)]", "in (np.argmin,)]",
        "tests/view/test_charts.py",
    ),
    DeliberateBug(  # the view from behind where nothing is hidden
        "src/chladni/view/camera.py", "if shown.mean() > 0.85", "if shown.mean() < 0.85",
        "tests/view/test_surface.py",
    ),
    DeliberateBug(  # a misspelt command is a fault of chladni
        "src/chladni/cli/app.py", '.replace("?;", "?"), AT_FAULT)', '.replace("?;", "?"), 1)',
        "tests/cli/test_console.py",
    ),
    DeliberateBug(  # transients have half the cycles that they need
        "src/chladni_planning/measurement_lines.py", "f / (2 * np.pi * damping * frequency)",
        "f / (4 * np.pi * damping * frequency)", "tests/planning/test_measurement_lines.py",
    ),
    DeliberateBug(  # cords of twice the mass
        "src/chladni_bench/cords.py", "tension / (4 * length", "tension / (2 * length",
        "tests/bench/test_bench_rig.py",
    ),
    DeliberateBug(  # one at a time begins at the ends of the ranges
        "src/chladni_studies/designs.py", "points = np.tile(own, (1 + levels * d, 1))",
        "points = np.tile(0 * own, (1 + levels * d, 1))", "tests/studies/test_parameter_study.py",
    ),
    DeliberateBug(  # the ring about a hole does not close
        "src/chladni_specimens/holed_plate.py", "nxt = (j + 1) % n",
        "nxt = np.minimum(j + 1, n - 1)", "tests/specimens/test_holed.py",
    ),
    DeliberateBug(  # a wrong name counts as found
        "evidence/chladni_evidence/blind_power.py", "if r[\"times\"] == times], NAMED))",
        "if r[\"times\"] == times], (*NAMED, \"wrong\")))", "tests/evidence/test_blind_power.py",
    ),
    DeliberateBug(  # a score that counts what the start brought
        "envs/chladni_envs/sensor_placement.py", "float(self.walk.log_det - self.start)",
        "float(self.walk.log_det)", "tests/envs/test_agents.py",
    ),
)  # fmt: skip
