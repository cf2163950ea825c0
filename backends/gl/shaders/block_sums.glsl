// Sums of a block of 64 columns and four rows. Its invocations leave theirs, then one for each sum adds them up in double, first
// to last. To be included after kSums; `put` is called by all 64 for all sums, and then add_up.

const uint kLanes = 64;
shared float lanes[kSums * (kLanes + 1)];  // one more, so that those who add up read from different banks

void put(uint sum, float value) { lanes[sum * (kLanes + 1) + gl_LocalInvocationID.x] = value; }

/// `first_sum`: of the frame, where the block's sums begin.
void add_up(ViewData view, uint first_sum, uint sums_per_frame) {
    barrier();
    const uint sum = gl_LocalInvocationID.x;
    if (sum >= kSums) return;
    double total = 0;
    for (uint i = 0; i < kLanes; ++i) total += double(lanes[sum * (kLanes + 1) + i]);
    const uint block = gl_WorkGroupID.y * ((view.size_px.x + kLanes - 1) / kLanes) + gl_WorkGroupID.x;
    partials[(gl_WorkGroupID.z * sums_per_frame + first_sum + sum) * scene.counts.y + block] = total;
}
