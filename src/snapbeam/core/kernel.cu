// One run a thread: the same text for a GPU, compiled by NVRTC for the structure at hand, in which everything is of the device.
//
// The macros of layout.hpp say how many there are of each part, SNAPBEAM_FIXED the modes of Thread<>, SNAPBEAM_LAWS the laws that
// channels have, bit by bit.  A launch takes *budget* steps of each thread; what a thread holds is put aside between launches, word by
// word of all threads.
#include "control.hpp"

namespace SNAPBEAM_SET {
typedef Thread<SNAPBEAM_FIXED> L;

struct Shared {  // by all threads; the host reads the counters
    int next, done, stop;
    Problem problem;
    Batch batch;
    Structure<L> structure;
};

extern "C" __global__ void sizes(long long *of) { of[0] = sizeof(Shared), of[1] = sizeof(Group<L>); }

extern "C" __global__ void begin_runs(const Problem *problem, const Batch *batch, Shared *shared) {
    shared->next = shared->done = shared->stop = 0;
    shared->problem = *problem, shared->batch = *batch;
    shared->batch.next = &shared->next, shared->batch.done = &shared->done, shared->batch.stop = &shared->stop;
    Arena none{nullptr, 0};
    shared->structure.build(shared->problem, none);
}

extern "C" __global__ void __launch_bounds__(SNAPBEAM_BLOCK) go_on(Shared *shared, long long *aside, int budget, int begins) {
    Group<L> group;
    constexpr int words = sizeof(group) / sizeof(long long);
    const long threads = long(gridDim.x) * blockDim.x;
    aside += long(blockIdx.x) * blockDim.x + threadIdx.x;
    long long *own = reinterpret_cast<long long *>(&group);
#pragma unroll 1
    for (int i = 0; i < words; ++i) own[i] = begins ? 0 : aside[i * threads];
    __shared__ long long place[sizeof(Structure<L>) / sizeof(long long)];  // read at every step
    for (int i = threadIdx.x; i < sizeof(place) / sizeof(long long); i += blockDim.x) place[i] = reinterpret_cast<long long *>(&shared->structure)[i];
    __syncthreads();
    Arena none{nullptr, 0};
    group.lay_out(*reinterpret_cast<Structure<L> *>(place), shared->batch, none);
    if (begins) group.begin();
    else group.key = -1.0;  // flows lie elsewhere
    // The warps of a block take each step together.
    for (int step = 0; step < budget && __syncthreads_or(group.alive); ++step) {
        if (group.alive) group.propose();
        __syncthreads();
        if (group.alive) take_step(group.z);
        __syncthreads();
        if (group.alive) group.inspect();
    }
#pragma unroll 1
    for (int i = 0; i < words; ++i) aside[i * threads] = own[i];
}
}  // namespace SNAPBEAM_SET
