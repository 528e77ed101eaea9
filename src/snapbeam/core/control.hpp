// The controller, once for every layout: propose a step, take it, inspect it, accept it or take a shorter one.
//
// In free flight a step is the flight step.  It is halved where the tension differs from that in the wells by more than STRETCH_LIMIT
// of it, again for every factor STRETCH_FACTOR, or where the energy of the beam alone is beyond CALM_ENERGY, again for every factor of
// four (it is looked at where a contact changes, and every ANCHOR steps in contact or where something else gives energy).  In contact,
// steps grow from the onset and shrink towards the release, down to SHORTEST.  By a force of stiffness k along a row r, h (k r.r)^(1/2)
// <= CONTACT_TURN, and by one of damping B, h (B r.r) <= CONTACT_DECAY, down to the shortest length; where damping reverses,
// by_reversal has its own, and that of constant coefficients is in the flight step.  Towards the end of the range of a law a step covers NEARER of
// the way.  No circuit is half resolved.
//
// A step inside which a contact closes or opens, a lossy contact begins or ceases to press, or one with memory yields or turns back, is
// cut to end there.  The cut is corrected on the true motion, up to CORRECTIONS times: a zero of the gap to a tick, one of the force to
// 1e-9 of a flight step.  If several do, the first one counts; the others are found again.  A force that begins acts from the first
// kick of the next step.  A step to a jump of a signal ends there too.  Each run of a pack has its own time, length of step and
// contacts; a run that ends is replaced.
#pragma once
#include "statistics.hpp"

namespace SNAPBEAM_SET {

constexpr double GRADING = 0.5, RELEASE = 0.5, NEARER = 0.2, STRETCH_LIMIT = 4.0, STRETCH_FACTOR = 3.0, NOISE = 1e-12;
constexpr double CONTACT_TURN[3] = {0.5, 0.35, 0.35}, CONTACT_DECAY[3] = {1.5, 0.75, 0.75};  // of each composition
constexpr double REVERSAL[3] = {1.0, 0.5, 0.5}, SLIDING = 4.0;  // friction reverses: change of speed in a step, and speed above which it slides, over the scale
constexpr double ACROSS[3] = {1.0, 0.125, 0.125};  // drag reverses (scale 0): shortest step across zero speed, over the flight step
constexpr int CORRECTIONS = 6, MOST_CUTS = 40;
template <class L> constexpr int MOST_CORRECTIONS = L::directions > 0 ? 30 : CORRECTIONS;  // of a state the error is of second order, of derivatives of first

template <class L> struct Group;
template <class L>
typename L::Number acceleration_along(const Runs<L> &z, const Channel<L> &c, const typename L::Cell *q, const typename L::Cell *p,
                                      const typename L::Cell *k, int without);
template <class L>
typename L::Number pressed_by(const Runs<L> &z, const Channel<L> &c, const typename L::Cell *q, const typename L::Cell *p,
                              const typename L::Cell *k);
template <class L> void hit(Group<L> &runs, int number, typename L::Marks on);
template <class L> void jumped_velocity(Group<L> &runs, typename L::Marks which);
template <class L> void hold_together(Group<L> &runs, Channel<L> &c);
template <int K> void move_in_time(Group<Tangents<K>> &runs, Dual<K> later);

// What a channel does at the end of a step.
template <class L> struct Event {
    typename L::Marks flip;       // the contact opens or closes
    typename L::Marks force;      // a lossy contact begins or ceases to press, one with memory yields or turns back
    typename L::Real at_force;    // 1: the step is cut at such a change
    typename L::Real low, low_f, high, high_f;  // bracket of it: ticks, and the force there
};

template <class L> struct Group {
    typedef typename L::Number Number;
    typedef typename L::Real Real;
    typedef typename L::Cell Cell;
    typedef typename L::Plain Plain;
    typedef typename L::Marks Marks;

    Structure<L> *s;
    const Problem *problem;
    const Batch *batch;
    Runs<L> z;
    Totals<L> totals;
    static constexpr int FLOWS = DISTINCT_FLOWS * CELLS * 4;
    Held<Plain, FLOWS * LEVELS> tables;  // flows of the steps of every length, and of another one
    Held<Plain, FLOWS> own;
    Held<Slopes<L>, 0, false> table_slopes, own_slopes;  // their derivatives, of a structure that changes
    Held<Cell, CELLS * Inside<L>::ROWS> scratch;
    Held<Plain, CELLS> amplitude;
    Held<Channel<L>, CHANNELS> channel;
    Held<Signal<L>, KNOWN_SIGNALS> signal;
    Held<Number, CHANNELS * BLOCK_ARRAYS> block;
    Held<int, CHANNELS> late;
    Marks alive, again, landing;  // running; taking a step again that was cut; a step up to an output or the end
    Real ticks, wanted;           // length of the step, and of the next one if it is taken again
    Real event, tries, cuts;      // contact at whose event the step is cut, corrections of it, cuts in all
    Real key;                     // ticks for which the flows were formed
    Held<Event<L>, CHANNELS> events;  // of each channel
    Held<Cell, 0, false> spare;          // rows and channels that a record puts aside
    Held<Channel<L>, 0, false> spare_channel;
    Real jump, turned;            // next jump of a signal, ticks; steps since signals were taken from the time
    Held<Real, LEVELS> lengths;   // of steps, ticks
    bool circuits, driven;        // there are circuits; others than contacts give energy to the beam
    Real step, contact_step, end, limit, output_interval, next_output, halvings, shortest, most_steps, stretch, stretch_at_rest, calm, energy, lowest;
    int run[L::runs], output[L::runs], next_jump[L::runs];

    SNAPBEAM_SELDOM void lay_out(Structure<L> &structure, const Batch &b, Arena &arena) {
        s = &structure, problem = s->problem, batch = &b;
        const int n = s->cells, channels = problem->channels;
        int signals = 0;
        while (signals < problem->signals && problem->signal_kinds[signals] != snapbeam::PARTIAL) ++signals;
        z.s = s, z.channels = channels, z.signals = signals, z.account = b.account || (RECORDS && b.recorder);
        Held<Cell, CELLS> *rows[] = {&z.q, &z.p, &z.k, &z.q1, &z.p1, &z.k1, &z.r};
        for (auto *row : rows) row->take(arena, n);
        scratch.take(arena, long(n) * Inside<L>::ROWS), amplitude.take(arena, n);
        const long flow = long(s->composition.distinct) * n * 4;
        tables.take(arena, flow * problem->levels), lengths.take(arena, problem->levels), own.take(arena, flow);
        table_slopes.take(arena, s->changes ? flow * problem->levels : 0), own_slopes.take(arena, s->changes ? flow : 0);
        channel.take(arena, channels), signal.take(arena, signals), block.take(arena, long(channels) * BLOCK_ARRAYS), late.take(arena, channels);
        z.channel = channel, z.signal = signal, z.block = block, z.late = late;
        events.take(arena, channels);
        spare.take(arena, b.recorder ? 3l * n : 0), spare_channel.take(arena, b.recorder ? channels : 0);
        totals.lay_out(*s, arena);
        if constexpr (!KNOWN) {
            Channel<L> unused;
            for (int j = 0; j < channels; ++j) {
                Channel<L> &c = arena.base ? z.channel[j] : unused;
                c.signal.take(arena, signals), c.factor.take(arena, signals);
                if (problem->laws[j] == CIRCUIT) c.along_q.take(arena, n), c.along_p.take(arena, n), c.along_M.take(arena, channels);
                c.row.take(arena, n), c.P.take(arena, problem->law_numbers), c.M.take(arena, channels);
            }
        }
    }

    SNAPBEAM_FN const Recorder *recorder() const { return RECORDS ? batch->recorder : nullptr; }

    // Does the first contact act where the displacement is observed, in every run?
    SNAPBEAM_SELDOM bool shares_row() const {
        if (!z.channels || !z.channel[0].contact) return false;
        for (int i = 0; i < batch->runs; ++i) {
            const int *row_of = batch->row_of + long(i) * (z.channels + 1);
            const double *one = batch->rows + long(row_of[0]) * problem->modes, *other = batch->rows + long(row_of[z.channels]) * problem->modes;
            for (int m = 0; one != other && m < problem->modes; ++m)
                if (one[m] != other[m]) return false;
        }
        return true;
    }

    // From memory that is zero; lanes that have no run have numbers, too.
    SNAPBEAM_SELDOM void begin() {
        z.tick = z.sign = z.parts = Real(1.0), z.flows = own, z.flow_slopes = nullptr;
        for (int i = 0; i < z.signals; ++i) {
            Signal<L> &one = z.signal[i];
            one.kind = problem->signal_kinds[i], one.pieces = batch->pieces, one.tangent = batch->tangent;
            one.window = problem->windows[i] < 0 ? nullptr : z.signal + problem->windows[i];
            one.at.cosine = one.begun.cosine = one.kept.cosine = Number(1.0), one.set_length(z.h);
        }
        for (int j = 0; j < z.channels; ++j) {
            Channel<L> &c = z.channel[j];
            c.law = problem->laws[j];
            with_law(c.law, [&](auto law) { c.contact = law.contact, c.lossy = law.lossy, c.timed = law.timed, c.affine = law.affine, c.state = law.state(batch->numbers + long(j) * problem->law_numbers), c.memory = law.memory, c.impulsive = law.impulsive; });
            c.circuit = c.law == CIRCUIT, circuits |= c.circuit, c.harvests = c.circuit || c.law == LINEAR_DAMPING, driven |= !c.contact && !c.harvests;
            for (int i = 0; i < z.signals; ++i)
                if (const double factor = problem->uses[j * problem->signals + i]; factor != 0.0) c.signal[c.uses] = i, c.factor[c.uses++] = factor;
            for (int i = 0; i < problem->law_numbers; ++i) c.P[i] = Number(1.0);
        }
        totals.shared = shares_row();
        unsigned fresh = 0;
        for (int l = 0; l < L::runs; ++l) fresh |= unsigned(load(l)) << l;
        start(fresh);
    }

    // Everything that a run needs to go on to the bit.
    template <class F> void visit(F number) {
        const int n = s->cells;
        for (int i = 0; i < n; ++i) number(z.q[i]), number(z.p[i]), number(z.k[i]);
        for (int i = 0; i < z.signals; ++i) z.signal[i].visit(number);
        number(z.t), number(jump), number(turned), number(z.sign), number(z.gq), number(z.qr), number(stretch), number(energy);
        for (int j = 0; j < z.channels; ++j) {
            Channel<L> &c = z.channel[j];
            number(c.onset), number(c.safe), number(c.d0), number(c.r0), number(c.own_impulse), number(c.deepest), number(c.hardest), number(c.f);
            Number closed = select(c.closed, Number(1.0), Number(0.0)), pressing = select(c.pressing, Number(1.0), Number(0.0));
            number(closed), number(pressing);
            if (c.state >= 0) number(c.P[c.state]), number(c.offset);
            c.closed = closed > Number(0.5), c.pressing = pressing > Number(0.5);
            for (Number &x : c.sums) number(x);
        }
        totals.visit(number);
    }

    // --- runs begin -----------------------------------------------------------------------------------------------------
    double of_run(int i, snapbeam::RunNumber k) const { return batch->run[long(i) * snapbeam::RUN_NUMBERS + k]; }

    // The next run takes lane l; false if there is none.
    SNAPBEAM_SELDOM bool load(int l) {
        const int taken = count(batch->next);
        const bool there = taken < batch->runs;
        set_lane(alive, l, there), set_lane(again, l, false), set_lane(landing, l, false);
        set_lane(z.h, l, 0.0), set_lane(z.drift, l, 0.0), set_lane(ticks, l, 0.0), set_lane(key, l, -1.0);
        for (int j = 0; j < z.channels && !there; ++j)  // nothing of a user is called for it
            for (int k = 0; k < problem->law_numbers && of_user(z.channel[j].law); ++k) set_lane(z.channel[j].P[k], l, 0.0);
        if (!there) return false;
        const int i = batch->order[taken], modes = problem->modes;
        run[l] = i, next_jump[l] = -1;
        using namespace snapbeam;
        set_lane(z.tick, l, of_run(i, TICK)), set_lane(step, l, of_run(i, STEP)), set_lane(end, l, of_run(i, END));
        set_lane(output_interval, l, of_run(i, OUTPUT_INTERVAL)), count_outputs(l, 0), set_lane(z.sign, l, of_run(i, WELL_SIGN));
        set_lane(contact_step, l, of_run(i, CONTACT_STEP)), set_lane(halvings, l, of_run(i, HALVINGS)), set_lane(shortest, l, of_run(i, SHORTEST)), set_lane(most_steps, l, of_run(i, MAX_STEPS));
        set_lane(stretch_at_rest, l, of_run(i, STRETCH)), set_lane(calm, l, of_run(i, CALM_ENERGY)), set_lane(lowest, l, of_run(i, LOWEST)), set_lane(z.t, l, 0.0), set_lane(stretch, l, 0.0);
        set_lane(z.parts, l, s->parts(of_run(i, STEP) * of_run(i, TICK)));
        for (int k = 0; k < z.signals; ++k) {
            Signal<L> &one = z.signal[k];
            const double *all = batch->signals + long(i) * problem->signals * SIGNAL_NUMBERS, *numbers = all + k * SIGNAL_NUMBERS;
            for (int x = 0; x < SIGNAL_NUMBERS; ++x) set_lane(one.p[x], l, numbers[x]);
            set_lane(one.low, l, NAN);  // nothing is at hand
            if (one.kind == TONES) one.tones[l] = all + long(numbers[FIRST_TONE]) * SIGNAL_NUMBERS;
        }
        for (int m = 0; m < modes; ++m) {
            set_element<L>(z.q, s->place[m], l, batch->q[long(i) * modes + m]);
            set_element<L>(z.p, s->place[m], l, batch->p[long(i) * modes + m]);
        }
        const double *rest = batch->rest + long(i) * (z.channels + 1);
        const int *row_of = batch->row_of + long(i) * (z.channels + 1);
        for (int j = 0; j < z.channels; ++j) {
            Channel<L> &c = z.channel[j];
            const double *row = batch->rows + long(row_of[j]) * modes;
            for (int m = 0; m < modes; ++m) set_element<L>(c.row, s->place[m], l, row[m]);
            for (int k = 0; k < problem->law_numbers; ++k)
                set_lane(c.P[k], l, batch->numbers[(long(i) * z.channels + j) * problem->law_numbers + k]);
            set_lane(c.rest, l, rest[j]), set_lane(c.offset, l, batch->offset[long(i) * z.channels + j] - (c.memory ? lane(value(c.P[c.state]), l) : 0.0));
            for (int k = 0; k < z.channels; ++k) {
                const double *other = batch->rows + long(row_of[k]) * modes;
                double product = 0.0;
                for (int m = 0; m < modes; ++m) product += row[m] * other[m];
                set_lane(c.M[k], l, product);
            }
            if (c.circuit) load_circuit(c, l, row, row_of);
            for (Number &x : c.sums) set_lane(x, l, 0.0);
            Number *zeros[] = {&c.begun, &c.own_impulse, &c.deepest, &c.hardest, &c.d0, &c.r0};
            for (Number *x : zeros) set_lane(*x, l, 0.0);
            set_lane(c.safe, l, 0.0), set_lane(c.onset, l, 0.0), set_lane(c.closed, l, false), set_lane(c.pressing, l, false);
        }
        const double *observed = batch->rows + long(row_of[z.channels]) * modes;
        totals.load(*batch, i, l, observed, rest[z.channels]);
        if constexpr (L::directions > 0) seed(i);
        advance_jump(l);
        // flows of the steps of every length
        const int n = s->cells, distinct = s->composition.distinct;
        // lengths of steps: halves of the flight step down to the contact step (of order 6 none between them), then halves of that
        const double contact = of_run(i, CONTACT_STEP);
        double length = of_run(i, STEP);
        for (int level = 0; level < problem->levels; ++level) {
            Plain *to = tables + long(level) * distinct * n * 4;
            form_flows(to, l, length * of_run(i, TICK));
            if constexpr (L::directions > 0) slopes_over(length * of_run(i, TICK), table_slopes + long(level) * distinct * n * 4);
            const double half = 0.5 * length;
            set_lane(lengths[level], l, length);
            length = length > contact || !level ? (problem->composition && !level ? contact : max(half, contact)) : half;
        }
        return true;
    }

    // Derivatives of what run i begins with.
    void seed(int i) requires(L::directions > 0) {
        const snapbeam::Tangent &t = *batch->tangent;
        const int modes = problem->modes, channels = z.channels, numbers = problem->law_numbers;
        for (int k = 0; k < L::directions; ++k) {
            const long row = long(i) * L::directions + k;
            for (int m = 0; m < modes; ++m) z.q[s->place[m]].d.set(k, t.q[row * modes + m]), z.p[s->place[m]].d.set(k, t.p[row * modes + m]);
            for (int j = 0; j < channels; ++j) {
                Channel<L> &c = z.channel[j];
                const long of = row * channels + j;
                for (int x = 0; x < numbers && !of_user(c.law); ++x) c.P[x].d.set(k, t.numbers[of * numbers + x]);
                for (int x = User::OWN; x < numbers && of_user(c.law); ++x) c.P[x].d.set(k, t.numbers[of * numbers + x]);
                if (c.state >= 0) c.P[c.state].d.set(k, t.laws[of]);
                c.rest.d.set(k, t.rest[of + row]), c.offset.d.set(k, t.offset[of] - (c.memory ? lane(c.P[c.state].d, k) : 0.0));
                for (int m = 0; m < modes; ++m) c.row[s->place[m]].d.set(k, t.rows[(of + row) * modes + m]);
            }
            const long observed = row * (channels + 1) + channels;  // each row of directions has one more than channels
            totals.rest.d.set(k, t.rest[observed]), totals.later.d.set(k, totals.late / end * t.end[row]);
            for (int m = 0; m < modes; ++m) totals.row[s->place[m]].d.set(k, t.rows[observed * modes + m]);
            for (int x = 0; x < z.signals; ++x)
                for (int y = 0; y < snapbeam::SIGNAL_NUMBERS; ++y) z.signal[x].p[y].d.set(k, t.signals[(row * problem->signals + x) * snapbeam::SIGNAL_NUMBERS + y]);
        }
        for (int x = 0; x < z.signals; ++x) {
            Signal<L> &one = z.signal[x];
            one.all = problem->signals, one.slopes = long(i) * L::directions * one.all + long(lane(one.p[snapbeam::FIRST_TONE], 0));
        }
        for (int j = 0; j < channels; ++j) {
            Channel<L> &c = z.channel[j];
            for (int x = 0; x < channels; ++x) c.M[x] = dot<L>(c.row, z.channel[x].row, s->size());
            for (int x = 0; c.circuit && x < channels; ++x) c.along_M[x] = Number(0.0);
            for (int m = 0; c.circuit && m < s->size(); ++m) {
                const OfMode<Number> of(c.P[0], c.row[m], s->omega[m], s->sigma[m]);
                c.along_q[m] = of.along_q, c.along_p[m] = of.along_p;
                for (int x = 0; x < channels && value(c.row[m]) != 0.0; ++x)
                    c.along_M[x] = of.slower ? c.along_M[x] + of.along_p * z.channel[x].row[m] : Number(INFINITY);
            }
        }
    }

    // What of a circuit of rate lam a mode carries along (step.hpp); slower: it does not decay as fast as an overdamped mode.
    template <class T> struct OfMode {
        T along_q, along_p;
        bool slower;
        OfMode(T lam, T row, T omega, T sigma) {
            const T D = lam * lam - T(2.0) * sigma * lam + omega * omega, t = value(row) != 0.0 ? row / D : T(0.0);
            along_q = t * (omega * omega), along_p = t * lam, slower = value(D) > 0.0;
        }
    };

    // What carries a circuit of run l along with the beam.
    SNAPBEAM_SELDOM void load_circuit(Channel<L> &c, int l, const double *row, const int *row_of) {
        double lam = lane(value(c.P[0]), l);
        // an overdamped mode may decay as the circuit does: the circuit then decays otherwise by as little as tells them apart
        const auto alike = [&](int m) {
            const double square = problem->omega[m] * problem->omega[m], D = lam * lam - 2.0 * problem->sigma[m] * lam + square;
            return row[m] != 0.0 && abs(D) < 1e-8 * (lam * lam + square);
        };
        for (int m = 0; m < problem->modes; ++m)
            while (alike(m)) lam *= 1.0 + 1e-7, m = 0;
        set_lane(c.P[0], l, lam);
        for (int k = 0; k < z.channels; ++k) set_lane(c.along_M[k], l, 0.0);
        for (int m = 0; m < problem->modes; ++m) {
            // beside an overdamped mode that decays as fast a circuit never follows
            const OfMode<double> of(lam, row[m], problem->omega[m], problem->sigma[m]);
            set_element<L>(c.along_q, s->place[m], l, of.along_q), set_element<L>(c.along_p, s->place[m], l, of.along_p);
            for (int k = 0; k < z.channels; ++k)
                set_lane(c.along_M[k], l, row[m] != 0.0 && !of.slower ? INFINITY : lane(value(c.along_M[k]), l) + of.along_p * batch->rows[long(row_of[k]) * problem->modes + m]);
        }
    }

    // The next jump of run l after its time.
    void advance_jump(int l) {
        const double *jumps = batch->jumps + long(run[l]) * problem->jumps;
        do ++next_jump[l];
        while (next_jump[l] < problem->jumps && jumps[next_jump[l]] <= lane(z.t, l));
        set_lane(jump, l, next_jump[l] < problem->jumps ? jumps[next_jump[l]] : NEVER);
    }

    // First observation of runs that begin, or begin again from their state alone at an output.
    SNAPBEAM_SELDOM void start(unsigned fresh, bool continued = false) {
        if (!fresh) return;
        const Marks which = FromBits<Marks>::of(fresh);
        const int n = s->size();
        begin_signals(which);
        for (int i = 0; i < z.signals; ++i) z.signal[i].at = z.signal[i].begun;
        assign(which, turned, Real(0.0));
        for (int j = 0; j < z.channels; ++j)
            if (!z.channel[j].contact) z.channel[j].active = true;
        for (int i = 0; i < n; ++i) z.q1[i] = z.q[i], z.p1[i] = z.p[i];
        tension_at(z, z.q1, z.k1);
        for (int i = 0; i < n; ++i) assign(which, z.k[i], z.k1[i]);
        assign(which, stretch, Real(value(fma(Number(2.0), z.gq, z.qr))));
        for (int j = 0; j < z.channels; ++j) {
            Channel<L> &c = z.channel[j];
            if (!c.contact) {
                if (!c.timed) assign(which, c.x, along(z, c, z.q));
                if (c.circuit) assign(which, c.r0, -fma(c.P[0], c.P[c.state], dot<L>(c.row, z.p, n)));
                continue;
            }
            const Number d = penetration(z, c, z.q), r = signal_slope(z, c) - dot<L>(c.row, z.p, n);
            Marks acts = acting(c);
            if (!continued) {
                unsigned on = 0;
                for (int l = 0; l < L::runs; ++l) {
                    if (!(fresh >> l & 1u)) continue;
                    const double since = batch->since[long(run[l]) * z.channels + j], depth = lane(value(d), l);
                    on |= unsigned(since == since ? since >= 0.0 : !c.impulsive && (depth > 0.0 || (depth == 0.0 && lane(value(r), l) > 0.0))) << l;
                    set_lane(c.onset, l, since > 0.0 ? -since : 0.0);
                }
                acts = FromBits<Marks>::of(on);
                assign(which & acts, c.deepest, max(d, Number(0.0)));
            }
            // a state tells no loose contact, in which a tip does not press, from one that is apart: its depth and force do
            const Marks loose = (!acts) & (d > Number(0.0)) & (!(with_law(c.law, [&](auto law) { return law.pressing(max(d, Number(0.0)), r, c.numbers()); }) > Number(0.0)));
            c.closed = (which & (acts | loose)) | (c.closed & (!which));
            if (!c.memory || !continued) c.pressing = (which & acts & (c.memory ? (r > Number(0.0)) & (!(d < yield_of(c))) : acts)) | (c.pressing & (!which));
            assign(which, c.d0, select(c.closed, d, min(d, Number(0.0)))), assign(which, c.r0, r), assign(which, c.safe, z.t);
        }
        assign(which, energy, value(totals.energy(z, true, true)));
        if (!continued) totals.start(z, which, totals.energy(z, true));
        const bool saved = recorder() && batch->recorder->marks[4];
        for (int j = 0; j < z.channels; ++j) {  // in touch and closing
            Channel<L> &c = z.channel[j];
            if (!c.impulsive || (saved && !continued)) continue;
            const Marks hits = which & (!c.closed) & (!(value(c.d0) < Real(0.0))) & (value(c.r0) > Real(0.0));
            if (any(hits)) hit(*this, j, hits), jumped_velocity(*this, hits);
        }
        if (!continued && saved) {  // goes on from a state that was saved
            const double *from = batch->recorder->saved;
            visit([&](auto &x) { __builtin_memcpy(&x, from, sizeof(x)), from += sizeof(x) / sizeof(double); });
        }
    }

    SNAPBEAM_FN void begin_signals(Marks which) {
        for (int i = 0; i < z.signals; ++i) z.signal[i].begin(which, z.t, z.tick, z.drift);
    }

    // --- propose --------------------------------------------------------------------------------------------------------
    SNAPBEAM_FN void propose() {
        const Marks fresh = alive & (!again);
        const int n = s->size();
        const Marks anchored = fresh & (turned >= Real(ANCHOR));
        begin_signals(anchored);
        assign(anchored, turned, Real(0.0));
        Marks pumped = anchored & FromBits<Marks>::of(driven ? ~0u : 0u);
        for (int j = 0; j < z.channels; ++j)
            if (z.channel[j].contact) pumped = pumped | (anchored & z.channel[j].closed);
        if (any(pumped)) assign(pumped, energy, value(totals.energy(z, true, true)));
        if (problem->shift) {  // modes about the well that the beam is near
            const Marks crossed = fresh & (z.sign * totals.center.u * Real(problem->center_rest) < Real(0.0));
            if (any(crossed)) {
                for (int i = 0; i < n; ++i) assign(crossed, z.q[i], Cell(fma(Cell(-z.sign), Cell(s->shift[i]), z.q[i])));
                assign(crossed, z.sign, -z.sign);
                tension_at(z, z.q, z.k1);
                for (int i = 0; i < n; ++i) assign(crossed, z.k[i], z.k1[i]);
                assign(crossed, stretch, Real(value(fma(Number(2.0), z.gq, z.qr))));
                totals.enter_well(z, crossed);
            }
        }
        // the longest step that is wanted, in ticks, and the first level whose steps are not longer
        Real want = step, reach = Real(STRETCH_LIMIT) * stretch_at_rest;
        Marks far = (abs(stretch) > reach) & (stretch_at_rest > Real(0.0));
        SNAPBEAM_LOOP
        for (int i = 0; i < problem->levels && any(far); ++i) {
            want = select(far, Real(0.5) * want, want), reach = Real(STRETCH_FACTOR) * reach;
            far = far & (abs(stretch) > reach);
        }
        Real most = calm, by_energy = step;
        Marks strong = energy > most;
        SNAPBEAM_LOOP
        for (int i = 0; i < problem->levels && any(strong); ++i) {
            by_energy = select(strong, Real(0.5) * by_energy, by_energy), most = Real(4.0) * most;
            strong = strong & (energy > most);
        }
        want = min(want, by_energy);
        for (int j = 0; j < z.channels; ++j) {
            const Channel<L> &c = z.channel[j];
            if (c.timed || c.circuit || (c.contact && !any(c.closed))) continue;
            const Number x = c.contact ? max(c.d0, Number(0.0)) : c.x;
            Real rate = sqrt(value(with_law(c.law, [&](auto law) { return law.stiffness(x, c.numbers()); }) * c.M[j])) * Real(1.0 / CONTACT_TURN[problem->composition]);
            if (c.lossy && (c.contact || !c.affine)) {  // damping that reverses has steps of its own
                const Number y = c.contact ? c.r0 : dot<L>(c.row, z.p, n);
                const Real damping = with_law(c.law, [&](auto law) { return select(value(law.reversal(c.numbers())) < Real(NEVER), Real(0.0), abs(value(law.damping(x, y, c.numbers())))); });
                rate = max(rate, damping * value(c.M[j]) * Real(1.0 / CONTACT_DECAY[problem->composition]));
            }
            const Real by_force = Real(1.0) / (max(rate, Real(1e-150)) * z.tick);
            if (!c.contact) {
                // towards the end of its range, where a force may be infinite, a share of the way
                const Number space = with_law(c.law, [&](auto law) { return min(law.high(c.numbers()) - c.x, c.x - law.low(c.numbers())); });
                want = min(want, by_force);
                const Real reversal = with_law(c.law, [&](auto law) { return value(law.reversal(c.numbers())); });
                if (any(reversal < Real(NEVER))) want = min(want, by_reversal(c, reversal));
                if (any(value(space) < Real(NEVER))) want = min(want, Real(NEARER) * value(space) / (abs(value(dot<L>(c.row, z.p, n))) * z.tick));
                continue;
            }
            const Real d = value(c.d0), r = value(c.r0);
            const Real own = min(Real(GRADING) * (z.t - c.onset), contact_step), left = Real(-RELEASE) * max(d, Real(0.0)) / (r * z.tick);
            want = select(c.closed, min(want, min(by_force, max(select(r < Real(0.0), min(own, left), own), shortest))), want);
        }
        Real level = Real(0.0), length = step;
        Marks more = alive;
        SNAPBEAM_LOOP
        for (int i = 0; i < problem->levels - 1; ++i) {
            Marks too_long = length > want;
            if (circuits) too_long = too_long | half_resolved(length);
            more = more & too_long & (Real(double(i)) <= halvings);
            if (L::runs == 1 && !any(more)) break;
            length = select(more, lengths[i + 1], length), level += select(more, Real(1.0), Real(0.0));
        }
        limit = min(next_output, end);
        landing = fresh & (z.t + length >= min(limit, jump));
        length = select(landing, min(limit, jump) - z.t, length);
        ticks = z.ticks = select(alive, select(again, wanted, length), Real(0.0));
        z.jumping = alive & (!(z.t + ticks < jump));
        z.h = Number(ticks * z.tick);
        const Marks changed = alive & differ(ticks, key);
        if (any(changed)) new_flows(changed, level, again | landing);
    }
    // Ticks in which the speed along a row changes by a share of the scale over which a force reverses, or falls to where it begins to.
    SNAPBEAM_SELDOM Real by_reversal(const Channel<L> &c, Real reversal) {
        for (int i = 0; i < z.signals; ++i) z.signal[i].copy(z.signal[i].at, z.signal[i].begun);
        const Number bend = acceleration_along(z, c, z.q, z.p, z.k, -1);
        const Real away = max(abs(value(dot<L>(c.row, z.p, s->size()))) - Real(SLIDING) * reversal, Real(0.0));
        const Real want = fma(Real(REVERSAL[problem->composition]), reversal, away) / (max(abs(value(bend)), Real(1e-300)) * z.tick);
        return select(reversal > Real(0.0), want, max(want, Real(ACROSS[problem->composition]) * step));
    }
    // Steps in which a circuit neither follows the beam nor changes slowly.
    SNAPBEAM_FN Marks half_resolved(Real length) const {
        Marks found = FromBits<Marks>::of(0);
        for (int j = 0; j < z.channels; ++j) {
            const Channel<L> &c = z.channel[j];
            if (!c.circuit) continue;
            const Real decay = value(c.P[0]) * length * z.tick;
            found = found | ((decay > Real(RESOLVED[problem->composition])) & (!follows(c, j, Number(decay))));
        }
        return found;
    }
    SNAPBEAM_FN void count_outputs(int l, int now) {
        output[l] = now, set_lane(next_output, l, (now + 1) * lane(output_interval, l));
    }

    SNAPBEAM_FN void new_flows(Marks changed, Real level, Marks odd) {
        key = select(changed, ticks, key);
        const long flow = long(s->composition.distinct) * s->size() * 4;
        const unsigned some = bits(changed & odd), usual = bits(changed & (!odd));
        for (int l = 0; l < L::runs; ++l) {
            if (some >> l & 1u) form_flows(own, l, lane(value(z.h), l));
            if (L::runs == 1 || !(usual >> l & 1u)) continue;
            const Plain *from = tables + long(lane(level, l)) * flow;
            for (long i = 0; i < flow; ++i) set_lane(own[i], l, lane(from[i], l));
        }
        if constexpr (L::runs == 1) z.flows = odd ? own : tables + long(level) * flow;
        if constexpr (L::directions > 0) {
            if (odd) slopes_over(value(z.h), own_slopes);
            z.flow_slopes = !s->changes ? nullptr : odd ? own_slopes : table_slopes + long(level) * flow;
        }
        set_lengths();
    }
    // What signals and circuits have for the length of the step.
    SNAPBEAM_FN void set_lengths() {
        for (int i = 0; i < z.signals; ++i) z.signal[i].set_length(z.h);
        for (int j = 0; j < z.channels; ++j)
            for (int f = 0; z.channel[j].circuit && f < s->composition.distinct; ++f) {
                const Number x = z.channel[j].P[0] * z.h;
                z.channel[j].decay[f] = decay_of(select(follows(z.channel[j], j, x), Number(0.0), x) * Number(s->composition.flow[f]));
            }
    }
    // Flows of the modes of one run over a step of *length*, modes and flows side by side.
    SNAPBEAM_FN void form_flows(Plain *to, int l, double length) {
        const int n = s->size(), all = s->composition.distinct * n;
        if constexpr (L::lanes > 1) {
            for (int i = 0; i < all; ++i) set_flow(typename L::Coef(s->composition.flow[i / n] * length), s->sigma[i % n], s->omega[i % n], to + 4 * i);
        } else {
            constexpr int W = SNAPBEAM_WIDTH;
            for (int from = 0, f = 0, m = 0; from < all; from += W) {
                const int count = all - from < W ? all - from : W;
                Wide time(0.0), omega(1.0), sigma(0.0), a[4];
                for (int k = 0; k < count; ++k) {
                    set_lane(time, k, length * s->composition.flow[f]), set_lane(omega, k, lane(s->omega[m], 0)), set_lane(sigma, k, lane(s->sigma[m], 0));
                    if (++m == n) m = 0, ++f;
                }
                set_flow(time, sigma, omega, a);
                for (int k = 0; k < 4 * count; ++k) set_lane(to[4 * from + k], l, lane(a[k % 4], k / 4));
            }
        }
    }
    // Derivatives of the flows of a structure that changes.
    void slopes_over(double length, Slopes<L> *to) requires(L::directions > 0) {
        for (int i = 0; s->changes && i < s->composition.distinct * s->size(); ++i) {
            Number a[4];
            set_flow(Number(length * s->composition.flow[i / s->size()]), s->sigma[i % s->size()], s->omega[i % s->size()], a);
            for (int x = 0; x < 4; ++x) to[4 * i + x] = a[x].d;
        }
    }
    SNAPBEAM_FN static Number yield_of(const Channel<L> &c) {
        return with_law(c.law, [&](auto law) { return law.yield(c.numbers()); });
    }
    // Positive while a closed contact goes on as it does: it presses, it yields and deepens, or it is elastic.
    SNAPBEAM_FN static Number going_on(const Channel<L> &c, Number d, Number r, Number f) {
        if (c.memory) return select(c.pressing, r, yield_of(c) - d);
        const Number raw = c.impulsive ? f : with_law(c.law, [&](auto law) { return law.pressing(max(d, Number(0.0)), r, c.numbers()); });
        return select(c.pressing, raw, -raw);
    }

    // --- inspect --------------------------------------------------------------------------------------------------------
    // Fraction of the step at which the gap of a contact closes; 2 where it does not.
    SNAPBEAM_SELDOM Real closing(Channel<L> &c, Marks near, Real noise) {
        const Real rest = (z.sign - Real(1.0)) * value(c.rest);
        Inside<L> inside;
        Real found = Real(2.0), off = Real(0.0), tilt = Real(0.0);
        keep_signals();
        // Impacts without duration leave gaps as small as the error of what is followed inside: first that at the end of the step is
        // found, which a cubic without value and slope at the beginning then takes away.
        for (int pass = c.impulsive ? 0 : 1; pass < 2; ++pass) {
            inside.begin(z, reinterpret_cast<Plain *>(static_cast<Cell *>(scratch)));
            for (int i = 0; i < z.signals; ++i) z.signal[i].copy(z.signal[i].at, z.signal[i].begun), z.signal[i].ahead(0, Number(inside.part));
            Real d0 = min(value(c.d0), Real(0.0)), r0 = value(c.r0);
            for (;;) {
                const Marks within = near & (inside.share < inside.parts) & (found > Real(1.0));
                if (!any(within)) break;
                inside.advance(*s);
                for (int i = 0; i < z.signals; ++i) z.signal[i].advance(0);
                const Real u = inside.share / inside.parts;
                Real d1 = value(c.offset) + value(signal_of(z, c)) - rest - value(dot<L>(c.row, inside.q, s->size()));
                Real r1 = value(signal_slope(z, c)) - value(dot<L>(c.row, inside.p, s->size()));
                if (pass == 0) {
                    const Marks last = within & (!(inside.share < inside.parts));
                    assign(last, off, value(c.d1) - d1), assign(last, tilt, (value(c.r1) - r1) * value(z.h));
                    continue;
                }
                d1 += u * u * fma(off, Real(3.0) - u - u, tilt * (u - Real(1.0)));
                r1 += u * fma(Real(6.0) * off, Real(1.0) - u, tilt * (Real(3.0) * u - Real(2.0))) / max(value(z.h), Real(1e-300));
                const Cubic<Real> gap(d0, r0, d1, r1, inside.part);
                const Marks may = within & (crest(gap, r0, r1) > noise);
                if (any(may)) {
                    const Real high = select(d1 > noise, Real(1.0), gap.summit());
                    found = select(may, (inside.share - Real(1.0) + root(gap, high, may)) / inside.parts, found);
                }
                d0 = min(d1, Real(0.0)), r0 = r1;
            }
        }
        restore_signals();
        return found;
    }
    // While the inside of a step is followed, the signals at its end are kept.
    SNAPBEAM_FN void keep_signals() {
        for (int i = 0; i < z.signals; ++i) z.signal[i].copy(z.signal[i].kept, z.signal[i].at);
    }
    SNAPBEAM_FN void restore_signals() {
        for (int i = 0; i < z.signals; ++i) z.signal[i].copy(z.signal[i].at, z.signal[i].kept), z.signal[i].formed = false;
    }

    // Open contacts that may close within the step.
    SNAPBEAM_FN Marks may_close(Channel<L> &c, Marks open, bool touching) {
        const int n = s->size();
        Plain speed = Plain(0.0), doubt = Plain(0.0);
        SNAPBEAM_LOOP
        for (int i = 0; i < n; ++i) {
            const Plain weight = abs(value(c.row[i]));
            Plain of_u, of_v;
            totals.doubts_of_mode(Plain(value(z.h)), Plain(value(s->omega[i])), of_u, of_v);
            speed = fma(weight, amplitude[i], speed), doubt = fma(weight * of_u, amplitude[i], doubt);
        }
        const Real horizon = Real(TRUST) * step * z.tick, h = value(z.h), d0 = value(c.d0), d1 = value(c.d1);
        const Real tip = bound_of_signals(z, c, [](const Signal<L> &one) { return one.greatest_slope(); });
        const Real tip_doubt = bound_of_signals(z, c, [&](const Signal<L> &one) { return one.doubt(Number(h)); });
        const Real push = largest_push(z, c.row, horizon, amplitude, [&](int j) { return value(c.M[j]); });
        const Real bound = fma(Real(MARGIN), L::total(speed), fma(push, horizon, tip));
        const Real until = z.t + min(-d0 / bound, horizon) / z.tick;
        // a bound that is not finite is unsafe
        const Marks finite = bound < Real(NEVER);
        assign(open, c.safe, select(finite & (!(until < z.t)), touching ? z.t : until, z.t));
        const Real swing = Real(4.0 / 27.0) * h * (max(value(c.r0), Real(0.0)) + max(-value(c.r1), Real(0.0)));
        const Real error = fma(Real(MARGIN), L::total(doubt), tip_doubt) + push * h * h * Real(1.0 / 64.0);
        const Marks clear = finite & (max(d0, d1) + swing + error <= Real(0.0));
        const Marks unreachable = finite & (z.t + ticks <= until);
        return open & (((!clear) & (!unreachable)) | (d1 > Real(0.0)));
    }

    // Gaps at the end of the step.
    SNAPBEAM_FN bool end_of_contacts() {
        bool touching = false;
        for (int j = 0; j < z.channels; ++j) hold_together(*this, z.channel[j]);
        for (int j = 0; j < z.channels; ++j) {
            Channel<L> &c = z.channel[j];
            if (c.circuit) c.r1 = select(c.follows, Number(0.0), -fma(c.P[0], c.z, dot<L>(c.row, z.p1, s->size())));
            if (!c.contact) continue;
            c.tip = signal_of(z, c), c.tip_slope = signal_slope(z, c);
            c.d1 = c.offset + c.tip - along(z, c, z.q1), c.r1 = c.tip_slope - dot<L>(c.row, z.p1, s->size());
            touching |= any(alive & c.closed);
        }
        return touching;
    }
    // What is zero where the step of contact j ends; *on_force*: where its force changes.
    Number zero_of(int j, bool on_force) {
        Channel<L> &c = z.channel[j];
        if (!on_force) return c.d1;
        return going_on(c, c.d1, c.r1, c.impulsive ? pressed_by(z, c, z.q1, z.p1, z.k1) : c.f);
    }
    // A step that ends where a contact opens, closes, yields or ceases to press, with the derivatives of that time.
    void follow_event() requires(L::directions > 0) {
        for (int j = 0; j < z.channels; ++j) {
            const Event<L> &e = events[j];
            const bool on_force = e.force && !e.flip;
            if (!z.channel[j].contact || !(e.flip || e.force)) continue;
            const auto lasting = [&](Number h) { z.h = h, set_lengths(), take_step(z), end_of_contacts(); };
            const Number gap = zero_of(j, on_force), h = Number(value(z.h));
            double rate = value(z.channel[j].r1);
            if (on_force) lasting(Number(value(h), 1.0)), rate = lane(zero_of(j, true).d - gap.d, 0);
            lasting(Number(value(h), rate != 0.0 ? Pack<L::directions>(-1.0 / rate) * gap.d : Pack<L::directions>(0.0)));
            z.drift += z.h - h, key = -1.0;
            return;
        }
    }

    SNAPBEAM_FN void inspect() {
        Marks redo = FromBits<Marks>::of(0), broken = FromBits<Marks>::of(0), pulled = FromBits<Marks>::of(0);
        const bool touching = end_of_contacts();
        for (int j = 0; j < z.channels; ++j) {  // out of the range in which a law is valid
            Channel<L> &c = z.channel[j];
            if (c.contact || c.timed) continue;
            const Number u = along(z, c, z.q1);
            const Number low_end = with_law(c.law, [&](auto law) { return law.low(c.numbers()); });
            const Number high_end = with_law(c.law, [&](auto law) { return law.high(c.numbers()); });
            const Marks out = !((u > low_end) & (u < high_end));
            broken = broken | out, pulled = pulled | (out & (value(c.first_f * (u - c.rest)) > Real(0.0)));
        }
        Real length = ticks, which = event;
        bool have_amplitudes = false;
        for (int j = 0; j < z.channels; ++j) {
            Channel<L> &c = z.channel[j];
            if (!c.contact) continue;
            const Real d0 = value(c.d0), r0 = value(c.r0), d1 = value(c.d1), r1 = value(c.r1);
            const Marks mine = again & (!differ(event, Real(double(j)))), others = alive & (!mine);
            Real at = Real(NEVER);
            Event<L> &e = events[j];
            e.flip = mine, e.force = FromBits<Marks>::of(0);
            if (c.lossy || c.memory) {  // where the force of a closed contact changes its sign, or its branch
                const Marks active = c.pressing;
                if (c.memory) broken = broken | (alive & c.closed & (!(value(yield_of(c)) <= Real(INFINITY))));  // of a user, NaN
                // the mean force of the last kick has no zero where the contact opens; that at the end of the step, times M, has
                const bool held = c.impulsive && any(c.closed);
                const Number end_f = held ? pressed_by(z, c, z.q1, z.p1, z.k1) : c.f, begin_f = held ? c.M[j] * c.first_f : c.first_f;
                const Real f1 = value(going_on(c, c.d1, c.r1, end_f));
                if (held) c.f = select(c.closed, end_f / c.M[j], c.f);
                const Marks wrong = alive & c.closed & (f1 < Real(0.0)) & (active | (d1 > Real(0.0)));
                const Marks cut_before = mine & c.closed & (!differ(e.at_force, Real(1.0)));
                const Marks first = wrong & (!cut_before);
                if (any(first)) {
                    const Real f0 = max(value(going_on(c, c.d0, c.r0, begin_f)), Real(0.0));
                    e.low = select(first, Real(0.0), e.low), e.low_f = select(first, f0, e.low_f), e.high_f = select(first, f1, e.high_f);
                    at = select(first, max(nearest(ticks * (f0 / (f0 - f1))), Real(1.0)), at);
                    e.high = select(first, ticks, e.high);
                    e.at_force = select(first, Real(1.0), e.at_force);
                }
                if (any(cut_before)) {  // regula falsi of Illinois between the ends of the bracket
                    const Marks under = cut_before & (f1 > Real(0.0)), over = cut_before & (!(f1 > Real(0.0)));
                    e.high_f = select(under, Real(0.5) * e.high_f, e.high_f), e.low_f = select(over, Real(0.5) * e.low_f, e.low_f);
                    e.low = select(under, ticks, e.low), e.low_f = select(under, f1, e.low_f);
                    e.high = select(over, ticks, e.high), e.high_f = select(over, f1, e.high_f);
                    const Real next = nearest(e.low + (e.high - e.low) * (e.low_f / (e.low_f - e.high_f)));
                    const Marks better = cut_before & (tries < Real(MOST_CORRECTIONS<L>)) & (abs(next - ticks) > step * Real(1e-9)) & (next > e.low) & (next < e.high);
                    // what is held together opens where its force would pull, so that it does not land again at once
                    const Marks pushes = under & (!better) & FromBits<Marks>::of(c.impulsive ? ~0u : 0u);
                    at = select(better, next, select(pushes, e.high, at));
                    e.flip = e.flip & (!cut_before);
                    e.force = cut_before & (!better) & (!pushes);
                }
            }
            const Marks at_force = e.force | (mine & c.closed & (!differ(e.at_force, Real(1.0))));
            const Marks on_gap = mine & (!at_force);
            if (any(on_gap)) {  // did the step that was cut end at the zero of the gap?
                const Marks right = (c.closed & (r1 < Real(0.0))) | ((!c.closed) & (r1 > Real(0.0)));
                const Real better = max(ticks - nearest(d1 / (r1 * z.tick)), Real(1.0));
                const Marks off = on_gap & right & differ(better, ticks) & (tries < Real(CORRECTIONS)) & (better < ticks + ticks);
                at = select(off, better, at), e.flip = e.flip & (!off);
            }
            const Marks leaving = others & c.closed & (d1 <= Real(0.0)) & (!at_force) & FromBits<Marks>::of(c.impulsive ? 0 : ~0u);
            if (any(leaving)) {
                const Cubic<Real> gap(-max(d0, Real(0.0)), -r0, -d1, -r1, value(z.h));
                const Marks cut = leaving & (d0 > Real(0.0)) & (d1 < Real(0.0));
                const Real when = max(nearest(ticks * root(gap, Real(1.0), cut)), Real(1.0));
                const Marks shorter = cut & (when < min(ticks, at));
                at = select(shorter, when, at);
                e.at_force = select(shorter, Real(0.0), e.at_force);
                e.flip = e.flip | (leaving & (!shorter) & (at >= ticks));
            }
            const Marks open = others & (!c.closed);
            // a contact without duration may rest on the tip: what rounding makes of the gap is no impact
            const Real noise = c.impulsive ? Real(NOISE) * (abs(value(c.tip_slope)) + abs(r1 - value(c.tip_slope))) * step * z.tick : Real(0.0);
            const Marks unsafe = open & (!(z.t + ticks <= c.safe) | !(d1 <= noise));
            if (any(unsafe)) {
                if (!have_amplitudes) amplitudes(z, amplitude, Real(TRUST) * step * z.tick), have_amplitudes = true;
                const Marks near = may_close(c, unsafe, touching);
                if (any(near)) {
                    totals.sum[snapbeam::SAMPLED_STEPS] += select(near, Number(1.0), Number(0.0));
                    Real found = closing(c, near, noise);
                    // a step that ends closed although nothing was seen inside it: at the zero of the cubic
                    const Marks unseen = near & (found > Real(1.0)) & (d1 > noise);
                    if (any(unseen)) found = select(unseen, root(Cubic<Real>(min(d0, Real(0.0)), r0, d1, r1, value(z.h)), Real(1.0), unseen), found);
                    const Real when = max(nearest(ticks * found), Real(1.0));
                    const Marks hit = near & (found <= Real(1.0)), shorter = hit & (when < ticks);
                    at = select(shorter, when, at);
                    e.at_force = select(hit, Real(0.0), e.at_force);
                    e.flip = e.flip | (hit & (!shorter));
                }
            }
            if (c.impulsive) e.flip = e.flip & (c.closed | (r1 > Real(0.0)));  // what opens does not strike
            const Marks sooner = (at < length) | (mine & (at < Real(NEVER)) & (!redo));
            length = select(sooner, at, length), which = select(sooner, Real(double(j)), which), redo = redo | sooner;
        }
        totals.sum[snapbeam::TRIALS] += select(alive, Number(1.0), Number(0.0));
        const Marks over = broken & (!pulled) & (cuts < Real(double(MOST_CUTS))) & (ticks > Real(1.0));  // a force that repels may turn a shorter step before
        length = select(over, max(nearest(Real(0.5) * ticks), Real(1.0)), length), which = select(over, Real(-1.0), which);
        broken = broken & (!over);
        redo = (redo | over) & alive & (cuts < Real(double(MOST_CUTS))) & (!broken);
        const Marks same = redo & again & (!differ(which, event));
        tries = select(same, tries + Real(1.0), Real(0.0));
        cuts = select(redo, cuts + Real(1.0), Real(0.0));
        wanted = length, event = select(redo, which, Real(-1.0));
        again = redo;
        accept(alive & (!redo), broken);
    }

    // --- accept ---------------------------------------------------------------------------------------------------------
    SNAPBEAM_FN void accept(Marks ok, Marks broken) {
        if (!any(ok)) return;
        const int n = s->size();
        bool was_touching = false;
        if constexpr (L::directions > 0) follow_event();
        if (recorder()) {
            record_inside(*this);
            for (int j = 0; j < z.channels; ++j) was_touching |= z.channel[j].contact && lane(z.channel[j].closed, 0);
        }
        if (!KNOWN && problem->updates) totals.update(z, ok, *batch, run);
        totals.add_step(z, ok, amplitude, scratch);
        if (bits(alive & (!ok)) || recorder()) {
            for (int i = 0; i < n; ++i) assign(ok, z.q[i], z.q1[i]), assign(ok, z.p[i], z.p1[i]), assign(ok, z.k[i], z.k1[i]);
        } else {  // runs that ended may hold anything
            z.q.swap(z.q1), z.p.swap(z.p1), z.k.swap(z.k1);
        }
        totals.add_modes(z, ok, z.h);  // before an impact changes the energy
        z.t = select(ok, z.t + ticks, z.t), turned += select(ok, Real(1.0), Real(0.0));
        for (int i = 0; i < z.signals; ++i) z.signal[i].go_on(ok);
        for (int j = 0; j < z.channels; ++j) {
            Channel<L> &c = z.channel[j];
            if (c.circuit) assign(ok, c.P[c.state], c.z), assign(ok, c.r0, c.r1);
        }
        const Marks jumped = ok & (!(z.t < jump));
        Number later = Number(0.0);  // derivatives of the time of the jump
        if constexpr (L::directions > 0) {
            for (int k = 0; jumped && k < L::directions; ++k) later.d.set(k, batch->tangent->jumps[(long(run[0]) * L::directions + k) * problem->jumps + next_jump[0]]);
            if (jumped) move_in_time(*this, later - z.drift);
        }
        if (any(jumped)) {
            for (int l = 0; l < L::runs; ++l)
                if (lane(jumped, l)) advance_jump(l);
            begin_signals(jumped);
            for (int i = 0; i < z.signals; ++i) z.signal[i].at = z.signal[i].begun;
            if constexpr (L::directions > 0) move_in_time(*this, -later);
        }
        assign(ok, stretch, Real(value(fma(Number(2.0), z.gq, z.qr))));
        Marks changed = FromBits<Marks>::of(0);
        for (int j = 0; j < z.channels; ++j) {
            Channel<L> &c = z.channel[j];
            if (!c.contact) continue;
            const Event<L> &e = events[j];
            const Marks off = ok & c.closed & e.flip, on = ok & (!c.closed) & e.flip, force = ok & e.force;
            assign(ok, c.d0, c.d1), assign(ok, c.r0, c.r1);
            if (!any(off | on | force)) continue;
            if (c.memory && any(force)) turn_back(c, force);
            if (c.impulsive) {
                if (any(on)) hit(*this, j, on);
                if (any(force)) close_impact(c, j, force);
                c.closed = c.closed & (!force), c.pressing = c.closed;
                changed = changed | on | force;
                continue;
            }
            const Marks ends = c.memory ? off : (off | force) & c.pressing, begins = c.memory ? on : on | (force & (!c.pressing));
            if (any(ends)) close_impact(c, j, ends);
            if (c.memory) {  // from an intact surface it yields at once
                c.pressing = (c.pressing & (!(off | force))) | (force & (!c.pressing)) | (on & (!(value(yield_of(c)) > Real(0.0))));
            } else if (any(force)) {  // what is stored where the force ceases is lost, and is there again where it begins
                const Number d = max(c.d1, Number(0.0)), stored = with_law(c.law, [&](auto law) { return law.potential(d, c.numbers()); });
                c.sums[snapbeam::LOST] += select(force, select(c.pressing, stored, -stored), Number(0.0));
            }
            if (!c.memory) c.pressing = (c.pressing & (!(off | force))) | begins;
            c.closed = (c.closed & (!off)) | on;
            assign(begins, c.onset, z.t);
            if constexpr (L::directions > 0) assign(begins, c.begun, z.drift);
            assign(on | off, c.d0, Number(0.0));  // the gap at an event is zero
            changed = changed | on | off | force;
        }
        Marks struck = FromBits<Marks>::of(0);
        for (int j = 0; j < z.channels; ++j)
            if (z.channel[j].impulsive) struck = struck | (ok & events[j].flip);
        if (any(struck)) jumped_velocity(*this, struck);
        if (any(jumped))  // the velocity of a striker may jump
            for (int j = 0; j < z.channels; ++j) {
                Channel<L> &c = z.channel[j];
                if (c.contact) assign(jumped, c.r0, signal_slope(z, c) - dot<L>(c.row, z.p, n)), assign(jumped, c.safe, z.t);
            }
        if (any(changed)) {
            assign(changed, energy, value(totals.energy(z, true, true)));
            for (int j = 0; j < z.channels; ++j) assign(changed, z.channel[j].safe, z.t);
        }
        if constexpr (L::directions > 0) {
            bool held = false;
            for (int j = 0; j < z.channels; ++j) held |= z.channel[j].contact && z.channel[j].closed;
            if (!held || z.t >= min(limit, end)) move_in_time(*this, -z.drift);
        }
        if (recorder()) record_end(*this, was_touching);
        const Marks finite = abs(totals.center.u) < Real(1e9);
        const Marks diverged = ok & (broken | (!finite));
        const Marks early = ok & totals.decided(z);
        const Marks spent = ok & (totals.so_far(snapbeam::STEPS) >= most_steps);
        const Marks reached = ok & (z.t >= min(limit, end));
        if (any(diverged | early | spent | reached)) stop_at(bits(diverged), bits(early), bits(spent), bits(reached));
    }

    // A contact begins to yield, or turns back: then it keeps a larger indentation, and what it stored and does not give back is lost.
    SNAPBEAM_SELDOM void turn_back(Channel<L> &c, Marks at) {
        const Marks turns = at & c.pressing;
        const Number grown = with_law(c.law, [&](auto law) { return law.grown(select(turns, c.d1, Number(0.0)), c.numbers()); });
        const Number growth = select(turns, grown - c.P[c.state], Number(0.0)), stored = with_law(c.law, [&](auto law) { return law.potential(c.d1, c.numbers()); });
        c.P[c.state] += growth, c.offset -= growth, c.d0 -= growth, c.d1 -= growth;
        assign(turns, c.deepest, c.d1);
        c.sums[snapbeam::LOST] += select(turns, stored - with_law(c.law, [&](auto law) { return law.potential(c.d1, c.numbers()); }), Number(0.0));
    }

    SNAPBEAM_SELDOM void close_impact(Channel<L> &c, int j, Marks off) {
        using namespace snapbeam;
        const Number zero = Number(0.0), peak = peak_of(c), lasted = Number((z.t - max(c.onset, Real(0.0))) * z.tick) + (z.drift - c.begun);
        const Marks counts = off & (c.deepest > zero);
        c.sums[IMPACTS] += select(counts, Number(1.0), zero);
        c.sums[IMPULSE] += select(off, c.own_impulse, zero);
        c.sums[CONTACT_TIME] += select(counts, lasted, zero);
        assign(counts, c.sums[PEAK_FORCE], max(c.sums[PEAK_FORCE], peak));
        assign(counts, c.sums[DEEPEST], max(c.sums[DEEPEST], c.deepest));
        if (recorder() && any(counts)) {
            Recorder &to = *batch->recorder;
            double *row = to.impact_rows + to.marks[2]++ * OF_IMPACT;
            row[IMPACT_CHANNEL] = j, row[IMPACT_ONSET] = lane(c.onset, 0) * lane(z.tick, 0);
            row[IMPACT_DURATION] = (lane(z.t, 0) - lane(c.onset, 0)) * lane(z.tick, 0);
            row[IMPACT_FORCE] = lane(value(peak), 0), row[IMPACT_IMPULSE] = lane(value(c.own_impulse), 0);
        }
        assign(off, c.deepest, zero), assign(off, c.hardest, zero), assign(off, c.own_impulse, zero);
    }
    SNAPBEAM_FN Number peak_of(const Channel<L> &c) const {
        if (c.lossy) return c.hardest;
        return with_law(c.law, [&](auto law) { return law.force(max(c.deepest, Number(0.0)), Number(0.0), c.numbers()); });
    }

    // Runs at an output, at their end, or that stop before it.
    SNAPBEAM_RARE void stop_at(unsigned diverged, unsigned early, unsigned spent, unsigned reached) {
        using namespace snapbeam;
        unsigned fresh = 0, going_on = 0;
        for (int l = 0; l < L::runs; ++l) {
            const unsigned bit = 1u << l;
            if (!((diverged | early | spent | reached) & bit)) continue;
            const bool over = lane(z.t, l) >= lane(end, l) || (diverged & bit);
            if (batch->outputs > output[l] && (recorder() || ((reached | early) & bit))) write_output(l);
            int status = RUNNING;
            if (diverged & bit) status = DIVERGED;
            else if (early & bit) status = EARLY_STOP;
            else if (over) status = OK;
            else if (spent & bit) status = STEP_LIMIT;
            if (status == RUNNING) {
                going_on |= bit;
                continue;
            }
            finish(l, status);
            if (recorder()) set_lane(alive, l, false);
            else fresh |= unsigned(load(l)) << l;
        }
        if (going_on) start(going_on, true);
        if (fresh) start(fresh);
    }

    SNAPBEAM_SELDOM void write_output(int l) {
        const int modes = problem->modes, width = 2 * modes + 1 + 2 * z.channels;
        double *to = batch->states + (long(run[l]) * batch->outputs + output[l]) * width;
        count_outputs(l, output[l] + 1);
        for (int m = 0; m < modes; ++m) to[m] = element<L>(z.q, s->place[m], l), to[modes + m] = element<L>(z.p, s->place[m], l);
        to[2 * modes] = lane(z.sign, l);
        for (int j = 0; j < z.channels; ++j) {
            const Channel<L> &c = z.channel[j];
            to[2 * modes + 1 + j] = lane(Marks(acting(c)), l) ? lane(z.t, l) - lane(c.onset, l) : -1.0;
            to[2 * modes + 1 + z.channels + j] = c.state < 0 ? 0.0 : lane(value(c.P[c.state]), l);
        }
        if constexpr (L::directions > 0) write_tangents();
    }
    // Derivatives of the time at hand as a share of the whole.
    Number later_end() const requires(L::directions > 0) {
        Number later = Number(0.0);
        for (int k = 0; k < L::directions; ++k) later.d.set(k, lane(z.t, 0) / lane(end, 0) * batch->tangent->end[long(run[0]) * L::directions + k]);
        return later;
    }
    // Derivatives of an output, whose time may move; after its state was written.
    void write_tangents() requires(L::directions > 0) {
        const int modes = problem->modes, width = 2 * modes + z.channels;
        const long first = (long(run[0]) * batch->outputs + output[0] - 1) * L::directions;
        const Number later = later_end();
        move_in_time(*this, later);
        for (int k = 0; k < L::directions; ++k) {
            double *to = batch->tangent->states + (first + k) * width;
            for (int m = 0; m < modes; ++m) to[m] = lane(z.q[s->place[m]].d, k), to[modes + m] = lane(z.p[s->place[m]].d, k);
            for (int j = 0; j < z.channels; ++j) to[2 * modes + j] = z.channel[j].state < 0 ? 0.0 : lane(z.channel[j].P[z.channel[j].state].d, k);
        }
        move_in_time(*this, -later);
    }

    SNAPBEAM_SELDOM void finish(int l, int status) {
        using namespace snapbeam;
        const Marks mine = FromBits<Marks>::of(1u << l);
        if constexpr (L::directions > 0) move_in_time(*this, later_end());
        totals.finish(z, mine);
        for (int j = 0; j < z.channels; ++j) {
            Channel<L> &c = z.channel[j];
            const bool pressed = c.contact && lane(Marks(acting(c)), l);
            const bool goes_on = batch->outputs && !recorder();
            if (pressed && goes_on) {  // the run goes on elsewhere: what the contact gave so far
                c.sums[CONTACT_TIME] += select(mine, Number((z.t - max(c.onset, Real(0.0))) * z.tick) + (z.drift - c.begun), Number(0.0));
                c.sums[IMPULSE] += select(mine, c.own_impulse, Number(0.0));
                assign(mine, c.sums[PEAK_FORCE], max(c.sums[PEAK_FORCE], peak_of(c)));
            }
            set_lane(c.sums[TOUCHING], l, pressed), set_lane(c.sums[ONSET], l, pressed ? lane(c.onset, l) : 0.0);
            if (pressed && !goes_on) close_impact(c, j, mine);
        }
        write_statistics(l, status);
        count(batch->done);
    }
    SNAPBEAM_SELDOM void write_statistics(int l, int status) {
        using namespace snapbeam;
        set_lane(totals.sum[STATUS], l, status), set_lane(totals.sum[TIME], l, lane(z.t, l));
        if (status == EARLY_STOP) set_lane(totals.sum[EARLY_STOP_TIME], l, lane(z.t, l) * lane(z.tick, l));
        for (int k = 0; k < STATISTICS; ++k) batch->statistics[long(run[l]) * STATISTICS + k] = lane(value(totals.sum[k]), l);
        for (int j = 0; j < z.channels; ++j)
            for (int k = 0; k < OF_CHANNEL; ++k)
                batch->of_channels[(long(run[l]) * z.channels + j) * OF_CHANNEL + k] = lane(value(z.channel[j].sums[k]), l);
        if constexpr (L::directions > 0)
            for (int d = 0; d < L::directions; ++d) {
                const long row = long(run[l]) * L::directions + d;
                for (int k = 0; k < STATISTICS; ++k) batch->tangent->statistics[row * STATISTICS + k] = lane(totals.sum[k].d, d);
                for (int j = 0; j < z.channels; ++j)
                    for (int k = 0; k < OF_CHANNEL; ++k) batch->tangent->of_channels[(row * z.channels + j) * OF_CHANNEL + k] = lane(z.channel[j].sums[k].d, d);
            }
    }

    // The runs at hand are left where they stand.
    void interrupt() {
        for (int l = 0; l < L::runs; ++l)
            if (lane(alive, l)) write_statistics(l, snapbeam::RUNNING);
        if (!recorder()) return;
        write_output(0), count_outputs(0, output[0] - 1);
        double *to = batch->recorder->saved;
        visit([&](auto &x) { __builtin_memcpy(to, &x, sizeof(x)), to += sizeof(x) / sizeof(double); });
        batch->recorder->marks[4] = 1;
    }
};

}  // namespace SNAPBEAM_SET

#include "impact.hpp"
#include "observers.hpp"

namespace SNAPBEAM_SET {

// Runs of one thread, until none is left or all are asked to stop.
template <class L> void integrate(const Problem &problem, const Batch &batch) {
    Structure<L> structure;
    Group<L> groups[L::together]{};
    Arena measured{nullptr, 0};
    structure.build(problem, measured, batch.tangent);
    for (Group<L> &group : groups) group.lay_out(structure, batch, measured);
    char *memory = static_cast<char *>(__builtin_calloc(measured.used + 64, 1));
    if (!memory) return void(__atomic_store_n(batch.lacking, 1, __ATOMIC_RELAXED));
    Arena arena{memory + (64 - reinterpret_cast<unsigned long long>(memory) % 64), 0};
    structure.build(problem, arena, batch.tangent);
    for (Group<L> &group : groups) group.lay_out(structure, batch, arena);
    for (Group<L> &group : groups) group.begin();
    long budget = batch.recorder ? batch.recorder->budget : 0;
    for (;;) {
        Group<L> *live[L::together];
        int count = 0;
        for (Group<L> &group : groups)
            if (any(group.alive)) live[count++] = &group;
        if (!count) break;
        if (__atomic_load_n(batch.stop, __ATOMIC_RELAXED) || (batch.recorder && (budget-- <= 0 || !has_room(*live[0])))) {
            for (int i = 0; i < count; ++i) live[i]->interrupt();
            break;
        }
        for (int i = 0; i < count; ++i) live[i]->propose();
        if (count == 1) {
            take_step(live[0]->z);
        } else {
            for (int i = 0; i < count; ++i) begin_step(live[i]->z);
            for (int stage = 0; stage <= structure.composition.flows; ++stage)
                for (int i = 0; i < count; ++i) take_stage(live[i]->z, stage);
        }
        for (int i = 0; i < count; ++i) live[i]->inspect();
    }
    __builtin_free(memory);
}

}  // namespace SNAPBEAM_SET
