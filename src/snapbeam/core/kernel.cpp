// The kernels of one layout and one instruction set: compiled several times, with SNAPBEAM_SET, SNAPBEAM_WIDTH and SNAPBEAM_LAYOUT
// set by the build.
#include "control.hpp"

namespace SNAPBEAM_SET {
#if SNAPBEAM_LAYOUT == 1
static bool halves(const Problem &problem, int modes) {  // symmetric and antisymmetric modes, as many of each
    return problem.modes == modes && problem.blocks == 2 && problem.block_sizes[0] == problem.block_sizes[1];
}
#endif
#if SNAPBEAM_LAYOUT == 0
void runs_side_by_side(const Problem &problem, const Batch &batch) { integrate<RunLanes<SNAPBEAM_WIDTH>>(problem, batch); }
#elif SNAPBEAM_LAYOUT == 1
void modes_side_by_side(const Problem &problem, const Batch &batch) {
    if (halves(problem, 32)) integrate<ModeLanes<SNAPBEAM_WIDTH, 32 / SNAPBEAM_WIDTH>>(problem, batch);
    else integrate<ModeLanes<SNAPBEAM_WIDTH>>(problem, batch);
}
#elif SNAPBEAM_LAYOUT == 2
void run_by_run(const Problem &problem, const Batch &batch) { integrate<Thread<>>(problem, batch); }
#else
void run_with_tangents(const Problem &problem, const Batch &batch) { integrate<Tangents<snapbeam::DIRECTIONS>>(problem, batch); }
#endif
}  // namespace SNAPBEAM_SET
