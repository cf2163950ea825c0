"""The same registration from Python as from the shell before: the same pose, bit for bit."""

import json

import numpy as np
import raylign

ct = raylign.read_volume("spine.mha", is_attenuation=True)
result = raylign.register(ct, "xrays/views.json", raylign.read_pose("start.json"), backend="cpu")
with open("result/pose.json") as file:
    of_program = np.array(json.load(file)["world_from_ct"])
assert np.array_equal(result.world_from_ct, of_program), (result.world_from_ct, of_program)
print("   the same pose, bit for bit")
