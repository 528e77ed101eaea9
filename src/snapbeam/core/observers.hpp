// Records of one run: states at given instants inside steps, ends of steps in contact, impacts.
//
// An instant inside a step is the end of a shorter step from the same beginning, which nothing else sees: what is recorded does not
// change the run.
#pragma once

namespace SNAPBEAM_SET {

// Room for what a step may add: instants, the end of a step in contact, an impact of each channel.
template <class L> bool has_room(const Group<L> &run) {
    const Recorder &to = *run.batch->recorder;
    const double until = (lane(run.z.t, 0) + lane(run.step, 0)) * lane(run.z.tick, 0) * (1.0 + 1e-12);
    long instants = 0;
    for (long i = to.marks[0]; i < to.instants && to.times[i] <= until && to.marks[1] + instants < to.samples; ++i) ++instants;
    if (lane(run.z.t, 0) + lane(run.step, 0) >= lane(run.end, 0)) instants = to.instants - to.marks[0];
    return to.marks[1] + instants + 2 <= to.samples && to.marks[2] + run.z.channels <= to.impacts;
}

// One sample of the state in q1, p1 at a time (s), with increments *within* a step that is not accepted yet.
template <class L> void write_sample(Group<L> &run, double time, bool within) {
    using namespace snapbeam;
    Runs<L> &z = run.z;
    Recorder &to = *run.batch->recorder;
    const Problem &problem = *run.problem;
    const int modes = problem.modes, width = OF_SAMPLE + CHANNEL_SAMPLE * z.channels;
    double *row = to.rows + to.marks[1] * 2 * modes, *values = to.values + to.marks[1] * width;
    ++to.marks[1];
    const bool there = lane(z.sign, 0) < 0.0;
    for (int m = 0; m < modes; ++m) {
        row[m] = element<L>(z.q1, run.s->place[m], 0) + (there && problem.shift ? problem.shift[m] : 0.0);
        row[modes + m] = element<L>(z.p1, run.s->place[m], 0);
    }
    const auto q = z.q, p = z.p;
    z.q = z.q1, z.p = z.p1;
    values[SAMPLE_TIME] = time;
    values[BEAM_ENERGY] = lane(value(run.totals.energy(z, false)), 0);
    z.q = q, z.p = p;
    const double share = within ? 1.0 : 0.0;
    values[SAMPLE_DISSIPATED] = lane(value(run.totals.sum[DISSIPATED]), 0) + share * lane(value(z.dissipated), 0);
    for (int j = 0; j < z.channels; ++j) {
        Channel<L> &c = z.channel[j];
        double *own = values + OF_SAMPLE + CHANNEL_SAMPLE * j;
        const auto x = c.contact ? penetration(z, c, z.q1) : along(z, c, z.q1);
        const auto v = dot<L>(c.row, z.p1, run.s->size()), y = c.contact ? signal_slope(z, c) - v : v;
        const auto pressed = max(x, typename L::Number(0.0));
        const auto stored = c.timed ? typename L::Number(0.0) : with_law(c.law, [&](auto law) { return law.potential(c.contact ? pressed : x, c.numbers()); });
        own[SAMPLE_DEPTH] = lane(value(x), 0);
        typename L::Number force = x;
        if (c.impulsive) force = select(acting(c), pressed_by(z, c, z.q1, z.p1, z.k1) / c.M[j], typename L::Number(0.0));
        else if (!c.circuit) force = c.timed ? signal_of(z, c) : c.contact && !(lane(value(x), 0) > 0.0) ? typename L::Number(0.0) : force_at(c, x, y);
        own[SAMPLE_FORCE] = lane(value(force), 0);
        own[SAMPLE_POTENTIAL] = c.contact && !lane(typename L::Marks(acting(c)), 0) ? 0.0 : lane(value(stored), 0);
        own[SAMPLE_WORK] = lane(value(c.sums[WORK]), 0) + share * lane(value(c.work), 0);
        own[SAMPLE_STATE] = c.state < 0 ? 0.0 : lane(value(c.circuit ? x : c.P[c.state]), 0);
        own[SAMPLE_LOST] = lane(value(c.sums[LOST]), 0) + share * lane(value(c.lost), 0);
    }
}

// Instants inside the step at hand, by steps that end there.
template <class L> void record_inside(Group<L> &run) {
    Recorder &to = *run.batch->recorder;
    Runs<L> &z = run.z;
    const double tick = lane(z.tick, 0), start = lane(z.t, 0) * tick, end = (lane(z.t, 0) + lane(run.ticks, 0)) * tick;
    const bool last = lane(z.t, 0) + lane(run.ticks, 0) >= lane(run.end, 0);
    if (to.marks[0] >= to.instants || !(to.times[to.marks[0]] <= end || last)) return;
    const int n = run.s->cells;
    const Runs<L> kept = z;
    const bool jumps = lane(z.jumping, 0);
    run.keep_signals();
    for (int i = 0; i < n; ++i) run.spare[i] = z.q1[i], run.spare[n + i] = z.p1[i], run.spare[2 * n + i] = z.k1[i];
    for (int j = 0; j < z.channels; ++j) run.spare_channel[j] = z.channel[j];
    while (to.marks[0] < to.instants && (to.times[to.marks[0]] <= end || last) && to.marks[1] + 1 < to.samples) {
        double part = to.times[to.marks[0]] - start;
        part = part < 0.0 ? 0.0 : part > end - start ? end - start : part;
        z.h = typename L::Number(part), z.jumping = FromBits<typename L::Marks>::of(jumps && part + 1.5 * tick >= end - start);
        run.form_flows(run.own, 0, part);
        z.flows = run.own;
        run.set_lengths();
        take_step(z);
        for (int j = 0; j < z.channels; ++j) hold_together(run, z.channel[j]);
        write_sample(run, to.times[to.marks[0]], true);
        ++to.marks[0];
    }
    z = kept;
    for (int j = 0; j < z.channels; ++j) z.channel[j] = run.spare_channel[j];
    for (int i = 0; i < n; ++i) z.q1[i] = run.spare[i], z.p1[i] = run.spare[n + i], z.k1[i] = run.spare[2 * n + i];
    run.restore_signals();
    run.key = typename L::Real(-1.0);
}

constexpr long MOST_IN_CONTACT = 96;  // steps of one contact whose ends are recorded

// The end of a step in contact, after it was accepted.
template <class L> void record_end(Group<L> &run, bool was_touching) {
    Recorder &to = *run.batch->recorder;
    bool touching = false;
    for (int j = 0; j < run.z.channels; ++j) touching |= run.z.channel[j].contact && lane(run.z.channel[j].closed, 0);
    if (!to.in_contact || !(touching || was_touching)) return;
    if (!was_touching) to.marks[3] = 0;
    if (to.marks[3] >= MOST_IN_CONTACT && touching) return;
    ++to.marks[3];
    write_sample(run, lane(run.z.t, 0) * lane(run.z.tick, 0), false);
}

}  // namespace SNAPBEAM_SET
