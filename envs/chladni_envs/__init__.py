"""Gymnasium environments over :mod:`chladni`; importing this package registers them.

>>> import gymnasium as gym
>>> env = gym.make("chladni_envs:chladni/SensorPlacement-v0")
>>> observation, info = env.reset(seed=1)
>>> observation.shape
(64,)
"""

from gymnasium.envs.registration import register, registry

IDS = {
    "chladni/SensorPlacement-v0": "chladni_envs.sensor_placement:SensorPlacementEnv",
    "chladni/ActuatorPlacement-v0": "chladni_envs.actuator_placement:ActuatorPlacementEnv",
    "chladni/ParameterSelection-v0": "chladni_envs.parameter_selection:ParameterSelectionEnv",
    "chladni/Calibration-v0": "chladni_envs.calibration_env:CalibrationEnv",
    "chladni/NextMeasurement-v0": "chladni_envs.next_measurement_env:NextMeasurementEnv",
}
for _id, _entry_point in IDS.items():
    if _id not in registry:
        register(id=_id, entry_point=_entry_point)
