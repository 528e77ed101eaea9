// What a host hands to a kernel and gets back: numbers and pointers to arrays, SI units.
//
// A Problem is what all runs share, a Batch what differs between them.  Time is counted in ticks, whole numbers below 2^53 that
// doubles hold exactly; *tick* is the length of one in seconds.
#pragma once

namespace snapbeam {

struct Problem {
    int modes;
    const double *omega, *sigma;  // q'' + 2 sigma q' + omega^2 q = ...
    const double *G, *g;          // tension: q'' = ... - gamma [(q.Gq) g + (2 g.q + q.Gq) Gq]
    double gamma;
    const double *shift;          // from the first well to its mirror image, as q; null: runs stay about the first well
    const double *far_force;      // acceleration about the mirror image where the wells are unequal; null
    double lift;                  // potential energy of the mirror image above the first well, J
    int blocks;                   // G couples no modes of different blocks, which follow each other
    const int *block_sizes;
    int composition;              // a number of COMPOSITIONS
    int channels;
    const int *laws;              // law of each channel
    int signals;
    const int *signal_kinds;      // a SignalKind of each
    const int *windows;           // signal by which each is multiplied, -1: none
    const double *uses;           // (channels, signals): factor of each signal in the motion or force of a channel
    int jumps;                    // of signals, of a run at most
    int law_numbers;              // numbers of a law in Batch.numbers
    const double *center;         // row of the centre, (modes,)
    const double *high;           // 1 of a mode that counts as high, else 0; null: none does
    const double *beam;           // 1 of a mode of the beam, 0 of one of a striker's own
    const double *second;         // the second well about the mirror image, as q; null: the mirror image itself
    double center_rest;           // displacement of the centre in the first well
    double dividing_height;       // displacement of the centre that divides the wells
    int levels;                   // lengths of steps: the flight step, of order 4 its halves, the contact step and its halves
    int updates;                  // statistics of a user
    const long long *update;      // address of the Update of each
};

// A statistic of a user after a step that was accepted: what it holds then, of what it held and of the step.  Values at
// both ends are a pair; penetration and touch are the first contact's, -1e30 and 0 without one.
enum Completed : int {
    COMPLETED_TIME, COMPLETED_LENGTH, COMPLETED_DISPLACEMENT, COMPLETED_VELOCITY = 4, COMPLETED_CENTER = 6,
    COMPLETED_CENTER_VELOCITY = 8, COMPLETED_PENETRATION = 10, COMPLETED_TOUCHING = 12, COMPLETED
};
typedef double (*Update)(double held, const double *step);

// Numbers of a run.  STEP is the flight step, CONTACT_STEP the longest step in contact, and a length is HALVINGS + 1 reductions below
// STEP at most (control.hpp: load), for an onset or a release SHORTEST.  With more than CALM_ENERGY (J above the first well) flight steps
// are shorter.  Flights after impulsive contact lower than LOWEST (m) are none if the chatter ends soon.
enum RunNumber : int {
    TICK, STEP, END, OUTPUT_INTERVAL, LAST_QUARTER, WELL_SIGN, CONTACT_STEP, HALVINGS, DECIDE_ENERGY, DECIDE_REACH, DECIDE_CROSSINGS,
    MAX_STEPS, STRETCH, CALM_ENERGY, LOWEST, SHORTEST, RUN_NUMBERS
};
// Numbers of a signal (signals.hpp): of a tone, with its period in ticks, 0 if it has none; of pieces; of a sweep; of a sum of tones,
// which names its first PARTIAL and has the rate of the fastest.  SHIFT is the time of its own at which a run begins, s; MOST_ are
// bounds of value, slope and second derivative.  Partials have the numbers of tones; they follow all signals and are none.
enum SignalKind : int { TONE, PIECES, SWEEP, TONES, PARTIAL, SIGNAL_KINDS };
enum SignalNumber : int {
    MEAN, AMPLITUDE, RATE, PHASE, PERIOD, EXPONENTIAL, POWER, MOST_VALUE, MOST_SLOPE, MOST_BEND, SIGNAL_NUMBERS,
    GAIN = 0, FIRST_PIECE = 1, PIECE_COUNT = 2, SHIFT = 3, SIZE = 0, FIRST_RATE = 1, LAST_RATE = 2, DURATION = 4, FIRST_TONE = 1, TONE_COUNT = 4
};
constexpr int PIECE_NUMBERS = 7;  // begin of a piece, s, and six coefficients
enum Status : int { OK, EARLY_STOP, RUNNING, DIVERGED, STEP_LIMIT };
enum Statistic : int {
    STATUS, TIME, SIDE, CROSSINGS, LATE_CROSSINGS, LAST_CROSSING, STEPS, TRIALS, SAMPLED_STEPS, MIN_DISPLACEMENT,
    MAX_DISPLACEMENT, MIN_CENTER, MAX_CENTER, PEAK_VELOCITY, PEAK_CENTER_VELOCITY, SQUARE_DISPLACEMENT, SQUARE_CENTER,
    SQUARE_VELOCITY, SQUARE_CENTER_VELOCITY, ENERGY_TIME, HIGH_ENERGY_TIME, DISSIPATED, FIRST_ENERGY, ENERGY,
    DISPLACEMENT, CENTER, EARLY_STOP_TIME, STATISTICS
};
// Of each channel; of a force only WORK, GROSS_WORK and LOST are not 0, of a circuit only LOST, its part in the last quarter and
// PEAK_FORCE.
enum OfChannel : int { IMPACTS, IMPULSE, WORK, GROSS_WORK, LOST, LATE_LOST, PEAK_FORCE, DEEPEST, CONTACT_TIME, TOUCHING, ONSET, OF_CHANNEL };
// Of a sample, and in addition penetration, force, potential energy, work and loss of each channel, state of its law.
enum OfSample : int { SAMPLE_TIME, BEAM_ENERGY, SAMPLE_DISSIPATED, OF_SAMPLE };
enum ChannelSample : int { SAMPLE_DEPTH, SAMPLE_FORCE, SAMPLE_POTENTIAL, SAMPLE_WORK, SAMPLE_LOST, SAMPLE_STATE, CHANNEL_SAMPLE };
enum OfImpact : int { IMPACT_CHANNEL, IMPACT_ONSET, IMPACT_DURATION, IMPACT_FORCE, IMPACT_IMPULSE, OF_IMPACT };

// Records of one run; a kernel returns when the room is used up, and goes on from *saved* in the next call.
struct Recorder {
    int instants;
    const double *times;          // (instants,) s, ascending
    bool in_contact;              // the ends of steps in contact too
    int samples, impacts;         // room
    double *rows;                 // (samples, 2 modes): q about the first well, p
    double *values;               // (samples, OF_SAMPLE + CHANNEL_SAMPLE channels)
    double *impact_rows;          // (impacts, OF_IMPACT)
    long *marks;                  // instants, samples and impacts recorded, samples of the contact at hand, begun
    double *saved;                // the state between two calls
    long budget;                  // steps of a call
};

// Derivatives along DIRECTIONS at a time: of the initial state, of the numbers of channels and signals; and of the output states.
constexpr int DIRECTIONS = 8, STRUCTURE_ROWS = 7, STRUCTURE_SCALARS = 4;
struct Tangent {
    const double *q, *p;          // (runs, DIRECTIONS, modes)
    const double *numbers;        // (runs, DIRECTIONS, channels, law_numbers)
    const double *laws;           // (runs, DIRECTIONS, channels): of the states of laws
    const double *offset;         // (runs, DIRECTIONS, channels)
    const double *rest, *rows;    // (runs, DIRECTIONS, channels + 1), (..., modes): the last is of the displacement observed
    const double *signals;        // (runs, DIRECTIONS, signals, SIGNAL_NUMBERS)
    const double *end;            // (runs, DIRECTIONS): of the time of the end, s
    const double *jumps;          // (runs, DIRECTIONS, jumps): of their times, s
    const double *pieces;         // (DIRECTIONS, pieces, PIECE_NUMBERS), each of all_pieces numbers; null: they do not change
    long all_pieces;
    const double *structure;      // (DIRECTIONS, STRUCTURE_ROWS, modes): omega, sigma, g, shift, far_force, center, second; null: it does not change
    const double *G;              // (DIRECTIONS, modes, modes)
    const double *scalars;        // (DIRECTIONS, STRUCTURE_SCALARS): gamma, center_rest, dividing_height, lift
    double *states;               // (runs, outputs, DIRECTIONS, 2 modes + channels): q, p, states of laws
    double *statistics, *of_channels;  // (runs, DIRECTIONS, STATISTICS), (runs, DIRECTIONS, channels, OF_CHANNEL)
};

struct Batch {
    int runs;
    const double *run;            // (runs, RUN_NUMBERS)
    const double *signals;        // (runs, signals, SIGNAL_NUMBERS)
    const double *pieces;         // (pieces, PIECE_NUMBERS)
    const double *jumps;          // (runs, jumps): ticks, ascending, after which a signal or a derivative has jumped
    const double *numbers;        // (runs, channels, law_numbers)
    const double *offset;         // (runs, channels): of a contact, penetration in the first well with its signals at 0
    const double *since;          // (runs, channels): ticks in contact at the start, negative: apart, NaN: the penetration decides
    const double *rows;           // (rows, modes)
    const int *row_of;            // (runs, channels + 1): row of each channel, then that of the displacement observed
    const double *rest;           // (runs, channels + 1): displacement along these in the first well
    const double *q, *p;          // (runs, modes) about the well of WELL_SIGN
    const int *order;             // (runs,): the order in which runs are taken
    int outputs;                  // output states of each run
    double *states;               // (runs, outputs, 2 modes + 1 + 2 channels): q, p, well, ticks in contact (-1: apart), states of laws
    double *statistics;           // (runs, STATISTICS)
    double *of_channels;          // (runs, channels, OF_CHANNEL)
    double *held;                 // (runs, updates): at first their values at the start
    bool account;                 // account for the dissipation of the modes
    const int *stop;
    int *next;                    // the next run, shared by threads
    int *done;                    // runs that ended
    int *lacking;                 // 1: a thread found no memory, and took no run
    Recorder *recorder;           // null: nothing is recorded
    const Tangent *tangent;       // null: no derivatives
};

typedef void (*Kernel)(const Problem &, const Batch &);

// Every array of a Problem and of a Batch: *moved*(pointer) may let it point elsewhere.
template <class F> void each_array(Problem &p, F moved) {
    moved(p.omega), moved(p.sigma), moved(p.G), moved(p.g), moved(p.shift), moved(p.far_force), moved(p.block_sizes), moved(p.laws);
    moved(p.signal_kinds), moved(p.windows), moved(p.uses), moved(p.center), moved(p.high), moved(p.beam), moved(p.second), moved(p.update);
}
template <class F> void each_array(Batch &b, F moved) {
    moved(b.run), moved(b.signals), moved(b.pieces), moved(b.jumps), moved(b.numbers), moved(b.offset), moved(b.since), moved(b.rows);
    moved(b.row_of), moved(b.rest), moved(b.q), moved(b.p), moved(b.order), moved(b.states), moved(b.statistics), moved(b.of_channels);
    moved(b.held);
}

}  // namespace snapbeam
