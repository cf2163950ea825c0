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

# Packages are built for any x86-64: the kernels of what this processor has must be in them.
flags = open("/proc/cpuinfo").read().split()
views = raylign.read_views("xrays/views.json")
costs = {name: float(raylign.Session(ct, views, raylign.Backend("cpu", instruction_set=name)).evaluate(of_program)[0])
         for name, flag in (("sse2", "sse2"), ("avx2", "avx2"), ("avx512", "avx512bw")) if flag in flags}
assert raylign.Backend("cpu").info["instruction_set"] == list(costs)[-1]
assert max(costs.values()) - min(costs.values()) < 1e-6, costs
print(f"   kernels: {', '.join(costs)}; without being asked: {list(costs)[-1]}")
