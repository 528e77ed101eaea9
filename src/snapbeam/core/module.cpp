// The Python module: mappings of arrays in, arrays out; threads, stop and progress; choice of the instruction set by cpuid.
//
// Every argument is checked here before a kernel starts: type, shape, finiteness, range.  A message names the argument.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <chrono>
#include <cmath>
#include <condition_variable>
#include <mutex>
#include <new>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#if defined(__x86_64__)
#include <cpuid.h>
#endif

#include "api.hpp"
#include "laws.hpp"
#include "sets.hpp"  // of the build
#include "structure.hpp"

namespace nb = nanobind;
using snapbeam::Batch;
using snapbeam::Problem;
using snapbeam::Recorder;

// --- instruction sets ---------------------------------------------------------------------------------------------------
#define SNAPBEAM_KERNELS(NAME)                                       \
    namespace NAME {                                                 \
    void runs_side_by_side(const Problem &, const Batch &);          \
    void modes_side_by_side(const Problem &, const Batch &);         \
    void run_by_run(const Problem &, const Batch &);                 \
    void run_with_tangents(const Problem &, const Batch &);          \
    }
SNAPBEAM_FOR_SETS(SNAPBEAM_KERNELS)

struct Set {
    const char *name;
    snapbeam::Kernel layouts[3], tangents;
};

static bool present(const std::string &set) {
    if (set == "avx2" || set == "avx512") {
#if defined(__x86_64__)
        // __builtin_cpu_supports needs a runtime that not every compiler brings
        unsigned a, b, c, d;
        if (!__get_cpuid(1, &a, &b, &c, &d)) return false;
        const bool fma = c >> 12 & 1u, saves = c >> 27 & 1u;
        if (!fma || !saves) return false;
        unsigned low, high;
        __asm__ volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
        if (!__get_cpuid_count(7, 0, &a, &b, &c, &d)) return false;
        const bool avx2 = b >> 5 & 1u, wide = (b >> 16 & 1u) && (b >> 17 & 1u) && (b >> 30 & 1u) && (b >> 31 & 1u);
        return set == "avx2" ? avx2 && (low & 6u) == 6u : wide && (low & 0xe6u) == 0xe6u;
#else
        return false;
#endif
    }
    return true;
}

static std::vector<Set> sets() {  // that this build and this processor have, best first
    std::vector<Set> found;
#define SNAPBEAM_SET_OF(NAME) \
    if (present(#NAME)) found.push_back({#NAME, {NAME::runs_side_by_side, NAME::modes_side_by_side, NAME::run_by_run}, NAME::run_with_tangents});
    SNAPBEAM_FOR_SETS(SNAPBEAM_SET_OF)
    return found;
}
static const char *LAYOUTS[] = {"runs", "modes", "thread"};

// --- arguments ----------------------------------------------------------------------------------------------------------
static std::string shape_words(const std::vector<size_t> &shape) {
    std::string words = "(";
    for (size_t i = 0; i < shape.size(); ++i) words += (i ? ", " : "") + std::to_string(shape[i]);
    return words + ")";
}

class Arguments {  // the arrays and numbers of one mapping
  public:
    Arguments(nb::dict given, const char *name, const Arguments *before = nullptr) : given_(given), name_(name), before_(before) {}

    template <class T, bool WRITABLE = false> T *array(const char *key, const std::vector<size_t> &shape, bool finite = true) {
        typedef nb::ndarray<std::conditional_t<WRITABLE, T, const T>, nb::c_contig, nb::device::cpu> Array;
        if (!given_.contains(key)) throw nb::value_error((where(key) + "is missing").c_str());
        Array found;
        if (!nb::try_cast<Array>(given_[key], found, false) || reinterpret_cast<size_t>(found.data()) % alignof(T))
            throw nb::type_error((where(key) + "must be a contiguous, aligned " + (WRITABLE ? "and writable " : "") + "array of " + (sizeof(T) == 8 ? "8" : "4") + "-byte numbers of the right kind").c_str());
        std::vector<size_t> own;
        for (size_t i = 0; i < found.ndim(); ++i) own.push_back(found.shape(i));
        if (own != shape) throw nb::value_error((where(key) + "has shape " + shape_words(own) + "; must have shape " + shape_words(shape)).c_str());
        if constexpr (std::is_floating_point_v<T>)
            if (finite)
                for (size_t i = 0; i < found.size(); ++i)
                    if (!std::isfinite(found.data()[i])) throw nb::value_error((where(key) + "must be finite").c_str());
        const char *first = reinterpret_cast<const char *>(found.data()), *last = first + found.nbytes();
        for (const Arguments *each = this; each; each = each->before_)
            for (const Held &held : each->arrays_)
                if ((WRITABLE || held.written) && first < last && first < held.last && held.first < last) refuse(key, "must not share memory with another array");
        arrays_.push_back({nb::ndarray<>(found.handle()), first, last, WRITABLE});
        return const_cast<T *>(found.data());
    }
    template <class T> T *optional(const char *key, const std::vector<size_t> &shape) {
        return has(key) ? array<T>(key, shape) : nullptr;
    }
    bool has(const char *key) const { return given_.contains(key) && !given_[key].is_none(); }
    double number(const char *key, double low, double high) {
        double found;
        if (!given_.contains(key) || !nb::try_cast<double>(given_[key], found)) throw nb::type_error((where(key) + "must be a number").c_str());
        if (!(found >= low && found <= high))
            throw nb::value_error((where(key) + "= " + std::to_string(found) + ": must be in [" + std::to_string(low) + ", " + std::to_string(high) + "]").c_str());
        return found;
    }
    int integer(const char *key, int low, int high) {
        const double found = number(key, low, high);
        if (found != std::floor(found)) throw nb::value_error((where(key) + "must be an integer").c_str());
        return int(found);
    }
    size_t length(const char *key) {
        if (!given_.contains(key)) throw nb::value_error((where(key) + "is missing").c_str());
        const Py_ssize_t found = PyObject_Size(nb::object(given_[key]).ptr());
        if (found >= 0) return size_t(found);
        PyErr_Clear();
        throw nb::type_error((where(key) + "must be an array").c_str());
    }
    std::string where(const char *key) const { return std::string(name_) + "['" + key + "'] "; }
    [[noreturn]] void refuse(const char *key, const char *words) const { throw nb::value_error((where(key) + words).c_str()); }

  private:
    nb::dict given_;
    const char *name_;
    const Arguments *before_;
    struct Held { nb::ndarray<> array; const char *first, *last; bool written; };  // an array of the arguments, whose memory stays
    std::vector<Held> arrays_;
};

static Problem problem_of(Arguments &a) {
    Problem p{};
    const size_t n = a.length("omega"), channels = a.length("laws"), blocks = a.length("block_sizes");
    if (n < 1 || n > 100000) a.refuse("omega", "must have 1 to 100000 modes");
    p.modes = int(n), p.channels = int(channels), p.blocks = int(blocks);
    p.omega = a.array<double>("omega", {n}), p.sigma = a.array<double>("sigma", {n});
    p.G = a.array<double>("G", {n, n}), p.g = a.array<double>("g", {n}), p.gamma = a.number("gamma", 0.0, 1e300);
    for (size_t i = 0; i < n; ++i)
        if (p.omega[i] < 0.0) a.refuse("omega", "must not be negative");
    p.shift = a.optional<double>("shift", {n}), p.far_force = a.optional<double>("far_force", {n});
    p.second = a.optional<double>("second", {n}), p.high = a.optional<double>("high", {n}), p.beam = a.array<double>("beam", {n});
    p.lift = a.number("lift", -1e300, 1e300);
    p.block_sizes = a.array<int>("block_sizes", {blocks});
    size_t together = 0;
    std::vector<size_t> block_of;
    for (size_t b = 0; b < blocks; ++b) {
        if (p.block_sizes[b] < 1 || size_t(p.block_sizes[b]) > n) a.refuse("block_sizes", "must be positive and add up to the modes");
        for (int i = 0; i < p.block_sizes[b]; ++i) block_of.push_back(b);
        together += size_t(p.block_sizes[b]);
    }
    if (together != n) a.refuse("block_sizes", "must be positive and add up to the modes");
    for (size_t i = 0; i < n; ++i)
        for (size_t j = 0; j < n; ++j)
            if (block_of[i] != block_of[j] && p.G[i * n + j] != 0.0) a.refuse("G", "must be zero between modes of different blocks");
    p.composition = a.integer("composition", 0, 2);
    p.laws = a.array<int>("laws", {channels});
    for (size_t j = 0; j < channels; ++j)
        if (p.laws[j] < 0 || p.laws[j] >= plain::LAWS) a.refuse("laws", "must be numbers of laws");
    p.signals = a.integer("signals", 0, 100000);
    p.uses = a.array<double>("uses", {channels, size_t(p.signals)});
    p.signal_kinds = a.array<int>("signal_kinds", {size_t(p.signals)}), p.windows = a.array<int>("windows", {size_t(p.signals)});
    for (int i = 0; i < p.signals; ++i) {
        if (p.signal_kinds[i] < 0 || p.signal_kinds[i] >= snapbeam::SIGNAL_KINDS) a.refuse("signal_kinds", "must be numbers of kinds");
        const int by = p.windows[i];
        if (by < -1 || by >= p.signals || (by >= 0 && (p.windows[by] != -1 || p.signal_kinds[by] == snapbeam::PARTIAL))) a.refuse("windows", "must be numbers of signals without a window, or -1");
        if (p.signal_kinds[i] != snapbeam::PARTIAL) continue;
        if (i + 1 < p.signals && p.signal_kinds[i + 1] != snapbeam::PARTIAL) a.refuse("signal_kinds", "must have the partials after the others");
        for (size_t j = 0; j < channels; ++j)
            if (p.uses[j * size_t(p.signals) + size_t(i)] != 0.0) a.refuse("uses", "must be 0 for partials");
    }
    p.jumps = a.integer("jumps", 0, 1000000);
    p.law_numbers = a.integer("law_numbers", 0, 64);
    for (size_t j = 0; j < channels; ++j)
        if (plain::with_law(p.laws[j], [](auto law) { return int(law.numbers); }) > p.law_numbers) a.refuse("law_numbers", "is less than a law has");
    p.center = a.array<double>("center", {n}), p.center_rest = a.number("center_rest", -1e300, 1e300);
    p.dividing_height = a.number("dividing_height", -1e300, 1e300);
    p.levels = a.integer("levels", 2, 40);
    const size_t updates = a.length("update");
    p.updates = int(updates), p.update = a.array<long long>("update", {updates}, false);
    for (size_t i = 0; i < updates; ++i)
        if (!p.update[i]) a.refuse("update", "must be addresses of functions");
    return p;
}

struct Shared {  // what threads share
    int next = 0, done = 0, stop = 0, lacking = 0;
};

static void check_user(Arguments &a, int law, const double *P, size_t numbers) {
    const double count = P[plain::User::COUNT], least = plain::with_law(law, [](auto each) { return each.memory ? 1.0 : 0.0; });
    if (!(count >= least && count <= double(numbers - plain::User::OWN) && count == std::floor(count))) a.refuse("numbers", "has not as many numbers of a user's law as it says");
}

static Batch batch_of(Arguments &a, const Problem &p, Shared &shared) {
    using namespace snapbeam;
    Batch b{};
    const size_t runs = a.length("run"), n = size_t(p.modes), channels = size_t(p.channels), rows = a.length("rows");
    if (runs < 1 || runs > 2000000000) a.refuse("run", "must have a run");
    b.runs = int(runs);
    b.run = a.array<double>("run", {runs, RUN_NUMBERS}, false);
    for (size_t i = 0; i < runs; ++i) {
        const double *run = b.run + i * RUN_NUMBERS;
        const double most = 9007199254740992.0;
        const RunNumber whole[] = {STEP, END, OUTPUT_INTERVAL};
        for (RunNumber k : whole)
            if (!(run[k] >= 1.0 && run[k] <= most && run[k] == std::floor(run[k]))) a.refuse("run", "must count steps and ends in whole ticks, 1 to 2^53");
        if (!(run[TICK] > 0.0 && run[TICK] < 1e300)) a.refuse("run", "must have a positive tick");
        if (!(run[WELL_SIGN] == 1.0 || run[WELL_SIGN] == -1.0)) a.refuse("run", "must begin about one of the wells");
        if (!(run[HALVINGS] >= 0.0 && run[HALVINGS] <= p.levels - 2)) a.refuse("run", "must have 0 <= halvings <= levels - 2");
        if (!(run[CONTACT_STEP] >= 1.0 && run[CONTACT_STEP] <= run[STEP])) a.refuse("run", "must have contact steps of 1 tick to a flight step");
        int halves = 1;  // of the flight step, down to the contact step
        for (double length = 0.5 * run[STEP]; length > run[CONTACT_STEP] && !p.composition; ++halves) length *= 0.5;
        const double of_flight = std::ldexp(1.0, halves - 1), of_contact = std::ldexp(1.0, int(run[HALVINGS]) + 1 - halves);
        if (halves > run[HALVINGS] + 1.0 || std::fmod(run[STEP], of_flight) != 0.0 || std::fmod(run[CONTACT_STEP], of_contact) != 0.0) a.refuse("run", "must have steps that halve to whole ticks");
        if (!(run[MAX_STEPS] >= 1.0)) a.refuse("run", "must be allowed a step");
        if (!(run[STRETCH] >= 0.0)) a.refuse("run", "must not have a negative stretch");
        if (!(run[CALM_ENERGY] >= 0.0)) a.refuse("run", "must not have a negative energy of calm motion");
    }
    b.signals = a.array<double>("signals", {runs, size_t(p.signals), SIGNAL_NUMBERS});
    const size_t pieces = a.length("pieces");
    b.pieces = a.array<double>("pieces", {pieces, size_t(PIECE_NUMBERS)});
    for (size_t i = 0; i < runs * size_t(p.signals); ++i) {
        const double *s = b.signals + i * SIGNAL_NUMBERS;
        const int kind = p.signal_kinds[i % size_t(p.signals)];
        if (kind == SWEEP && !(s[FIRST_RATE] > 0.0 && s[LAST_RATE] > 0.0 && s[DURATION] > 0.0 && (s[POWER] == 0.0 || s[POWER] == 1.0 || s[POWER] == 2.0)))
            a.refuse("signals", "must have sweeps of positive rates and durations, and of power 0, 1 or 2");
        if (kind == PIECES && !(s[FIRST_PIECE] >= 0.0 && s[PIECE_COUNT] >= 1.0 && s[FIRST_PIECE] + s[PIECE_COUNT] <= double(pieces) &&
                                s[FIRST_PIECE] == std::floor(s[FIRST_PIECE]) && s[PIECE_COUNT] == std::floor(s[PIECE_COUNT])))
            a.refuse("signals", "must have pieces of the table");
        if (kind == TONES && !(s[RATE] > 0.0 && s[FIRST_TONE] >= 0.0 && s[TONE_COUNT] >= 1.0 && s[FIRST_TONE] + s[TONE_COUNT] <= double(p.signals) &&
                               s[FIRST_TONE] == std::floor(s[FIRST_TONE]) && s[TONE_COUNT] == std::floor(s[TONE_COUNT]) && p.signal_kinds[int(s[FIRST_TONE])] == PARTIAL))
            a.refuse("signals", "must have sums of partials, and the rate of the fastest");
    }
    b.jumps = a.array<double>("jumps", {runs, size_t(p.jumps)}, false);
    for (size_t i = 0; i < runs * size_t(p.jumps); ++i)
        if (!(b.jumps[i] >= 0.0 && (i % size_t(p.jumps) == 0 || b.jumps[i] >= b.jumps[i - 1]))) a.refuse("jumps", "must be ticks, ascending");
    b.numbers = a.array<double>("numbers", {runs, channels, size_t(p.law_numbers)});
    for (size_t i = 0; i < runs * channels; ++i)
        if (const double *P = b.numbers + i * size_t(p.law_numbers); plain::of_user(p.laws[i % channels])) {
            check_user(a, p.laws[i % channels], P, size_t(p.law_numbers));
            if (P[plain::User::COUNT] != b.numbers[i % channels * size_t(p.law_numbers) + plain::User::COUNT]) a.refuse("numbers", "has not as many numbers of a user's law in every run");
        }
    b.offset = a.array<double>("offset", {runs, channels}), b.since = a.array<double>("since", {runs, channels}, false);
    b.rows = a.array<double>("rows", {rows, n});
    b.row_of = a.array<int>("row_of", {runs, channels + 1});
    for (size_t i = 0; i < runs * (channels + 1); ++i)
        if (b.row_of[i] < 0 || size_t(b.row_of[i]) >= rows) a.refuse("row_of", "must be numbers of rows");
    b.rest = a.array<double>("rest", {runs, channels + 1});
    b.q = a.array<double>("q", {runs, n}), b.p = a.array<double>("p", {runs, n});
    b.order = a.array<int>("order", {runs});
    std::vector<bool> seen(runs);
    for (size_t i = 0; i < runs; ++i) {
        if (b.order[i] < 0 || size_t(b.order[i]) >= runs || seen[size_t(b.order[i])]) a.refuse("order", "must name every run once");
        seen[size_t(b.order[i])] = true;
    }
    b.outputs = a.integer("outputs", 0, 2000000000);
    b.states = a.array<double, true>("states", {runs, size_t(b.outputs), 2 * n + 1 + 2 * channels}, false);
    b.statistics = a.array<double, true>("statistics", {runs, STATISTICS}, false);
    b.of_channels = a.array<double, true>("of_channels", {runs, channels, OF_CHANNEL}, false);
    b.held = a.array<double, true>("held", {runs, size_t(p.updates)}, false);
    b.account = a.integer("account", 0, 1) != 0;
    if (b.outputs)
        for (size_t i = 0; i < runs; ++i) {
            const double *run = b.run + i * RUN_NUMBERS;
            if (std::ceil(run[END] / run[OUTPUT_INTERVAL]) > b.outputs) a.refuse("states", "has no room for every output");
        }
    b.stop = &shared.stop, b.next = &shared.next, b.done = &shared.done, b.lacking = &shared.lacking;
    return b;
}

// --- calls --------------------------------------------------------------------------------------------------------------
static const Set &set_named(const std::string &name) {
    static const std::vector<Set> have = sets();
    if (name.empty()) return have.front();
    for (const Set &each : have)
        if (name == each.name) return each;
    throw nb::value_error(("instruction set '" + name + "' is not present").c_str());
}
static int layout_named(const std::string &name) {
    for (int i = 0; i < 3; ++i)
        if (name == LAYOUTS[i]) return i;
    throw nb::value_error(("layout '" + name + "': must be 'runs', 'modes' or 'thread'").c_str());
}

// Run *work* in threads; ten times a second signals are heard and *progress* is called, which may raise.
template <class Work> static void in_threads(int threads, Shared &shared, int runs, nb::object progress, Work work) {
    std::mutex mutex;
    std::condition_variable ended;
    int left = threads;
    std::vector<std::thread> pool;
    try {
        for (int i = 0; i < threads; ++i)
            pool.emplace_back([&] {
                work();
                const std::lock_guard<std::mutex> lock(mutex);
                --left;
                ended.notify_one();
            });
    } catch (const std::exception &) {  // no thread can start: those that did do the work, or this one
        const std::lock_guard<std::mutex> lock(mutex);
        left -= threads - int(pool.size());
        if (pool.empty()) work();
    }
    bool raised = false;
    {
        nb::gil_scoped_release release;
        std::unique_lock<std::mutex> lock(mutex);
        while (left > 0) {
            ended.wait_for(lock, std::chrono::milliseconds(100), [&] { return left == 0; });
            if (left == 0 || raised) continue;
            lock.unlock();
            {
                nb::gil_scoped_acquire acquire;
                raised = PyErr_CheckSignals() != 0;
                if (!raised && !progress.is_none()) {
                    PyObject *result = PyObject_CallFunction(progress.ptr(), "ii", __atomic_load_n(&shared.done, __ATOMIC_RELAXED), runs);
                    raised = result == nullptr;
                    Py_XDECREF(result);
                }
                if (raised) __atomic_store_n(&shared.stop, 1, __ATOMIC_RELAXED);
            }
            lock.lock();
        }
    }
    for (std::thread &each : pool) each.join();
    if (raised) throw nb::python_error();
    if (shared.lacking) throw std::bad_alloc();
}

// Laws and statistics of a user may call Python: a thread that is known to it calls ten times faster.
template <class Work> static void with_python(const Problem &p, Work work) {
    bool of_user = p.updates > 0;
    for (int j = 0; j < p.channels; ++j) of_user |= plain::of_user(p.laws[j]);
    if (!of_user) return work();
    nb::gil_scoped_acquire known;
    nb::gil_scoped_release meanwhile;
    work();
}

struct Call {  // the arguments of all calls, checked
    Arguments of_problem, of_batch;
    Shared shared;
    Problem p;
    Batch b;
    Call(nb::dict problem, nb::dict batch) : of_problem(problem, "problem"), of_batch(batch, "batch", &of_problem), p(problem_of(of_problem)), b(batch_of(of_batch, p, shared)) {}

    void run(snapbeam::Kernel kernel, int threads, nb::object progress) {
        if (threads < 1 || threads > 4096) throw nb::value_error("threads: must be 1 to 4096");
        in_threads(threads < b.runs ? threads : b.runs, shared, b.runs, progress, [&] { with_python(p, [&] { kernel(p, b); }); });
    }
};

static void integrate(nb::dict problem, nb::dict batch, const std::string &layout, const std::string &set, int threads, nb::object progress) {
    Call(problem, batch).run(set_named(set).layouts[layout_named(layout)], threads, progress);
}

static void integrate_tangents(nb::dict problem, nb::dict batch, nb::dict tangent, const std::string &set, int threads, nb::object progress) {
    using namespace snapbeam;
    Call call(problem, batch);
    Arguments a(tangent, "tangent", &call.of_batch);
    const Problem &p = call.p;
    Batch &b = call.b;
    const size_t runs = size_t(b.runs), n = size_t(p.modes), channels = size_t(p.channels), K = DIRECTIONS;
    Tangent t{};
    t.q = a.array<double>("q", {runs, K, n}), t.p = a.array<double>("p", {runs, K, n});
    t.numbers = a.array<double>("numbers", {runs, K, channels, size_t(p.law_numbers)});
    t.offset = a.array<double>("offset", {runs, K, channels}), t.rest = a.array<double>("rest", {runs, K, channels + 1});
    t.laws = a.array<double>("laws", {runs, K, channels});
    t.rows = a.array<double>("rows", {runs, K, channels + 1, n});
    t.signals = a.array<double>("signals", {runs, K, size_t(p.signals), SIGNAL_NUMBERS});
    t.end = a.array<double>("end", {runs, K});
    t.jumps = a.array<double>("jumps", {runs, K, size_t(p.jumps)});
    const size_t pieces = call.of_batch.length("pieces");
    t.pieces = a.optional<double>("pieces", {K, pieces, size_t(PIECE_NUMBERS)}), t.all_pieces = long(pieces) * PIECE_NUMBERS;
    t.structure = a.optional<double>("structure", {K, STRUCTURE_ROWS, n});
    if (t.structure) t.G = a.array<double>("G", {K, n, n}), t.scalars = a.array<double>("scalars", {K, STRUCTURE_SCALARS});
    t.states = a.array<double, true>("states", {runs, size_t(b.outputs), K, 2 * n + channels}, false);
    t.statistics = a.array<double, true>("statistics", {runs, K, STATISTICS}, false);
    t.of_channels = a.array<double, true>("of_channels", {runs, K, channels, OF_CHANNEL}, false);
    b.tangent = &t;
    call.run(set_named(set).tangents, threads, progress);
}

static void record(nb::dict problem, nb::dict batch, nb::dict recorder, const std::string &layout, const std::string &set) {
    using namespace snapbeam;
    Call call(problem, batch);
    Arguments of_recorder(recorder, "recorder", &call.of_batch);
    const Problem &p = call.p;
    Batch &b = call.b;
    if (b.runs != 1) throw nb::value_error("batch: must be one run");
    Recorder r{};
    const size_t instants = of_recorder.length("times"), samples = of_recorder.length("rows"), impacts = of_recorder.length("impacts");
    r.instants = int(instants), r.samples = int(samples), r.impacts = int(impacts);
    if (samples < 4 || impacts < size_t(p.channels) + 1) throw nb::value_error("recorder: must have room for 4 samples and an impact of each channel");
    r.times = of_recorder.array<double>("times", {instants});
    for (size_t i = 1; i < instants; ++i)
        if (r.times[i] < r.times[i - 1]) of_recorder.refuse("times", "must ascend");
    r.in_contact = of_recorder.integer("in_contact", 0, 1) != 0;
    r.rows = of_recorder.array<double, true>("rows", {samples, 2 * size_t(p.modes)}, false);
    r.values = of_recorder.array<double, true>("values", {samples, size_t(OF_SAMPLE + CHANNEL_SAMPLE * p.channels)}, false);
    r.impact_rows = of_recorder.array<double, true>("impacts", {impacts, OF_IMPACT}, false);
    r.marks = of_recorder.array<long, true>("marks", {5});
    const long most[] = {r.instants, r.samples, r.impacts, 1000000, 1};  // instants passed, samples, impacts, steps of a contact, begun
    for (int i = 0; i < 5; ++i)
        if (r.marks[i] < 0 || r.marks[i] > most[i]) of_recorder.refuse("marks", "must count what is recorded");
    const size_t saved = of_recorder.length("saved");
    // as many numbers as any layout of any width holds of a run
    const size_t wanted = (size_t(p.modes + 64) * 3 + size_t(p.channels) * (12 + OF_CHANNEL) + STATISTICS + size_t(p.signals) * 6 + 32) * 8;
    if (saved < wanted) of_recorder.refuse("saved", "has no room for the state of a run");
    r.saved = of_recorder.array<double, true>("saved", {saved}, false);
    r.budget = long(of_recorder.number("budget", 1.0, 2e9));
    b.recorder = &r;
    call.run(set_named(set).layouts[layout_named(layout)], 1, nb::none());
}

// For a GPU: a problem and a batch as bytes, whose arrays lie where *moved* says (addresses there by addresses here).
static nb::tuple moved_arguments(nb::dict problem, nb::dict batch, nb::dict moved) {
    Call call(problem, batch);
    Problem &p = call.p;
    Batch &b = call.b;
    const auto move = [&](auto *&at) {
        if (at) at = reinterpret_cast<std::remove_reference_t<decltype(at)>>(nb::cast<size_t>(moved[nb::int_(reinterpret_cast<size_t>(at))]));
    };
    snapbeam::each_array(p, move), snapbeam::each_array(b, move);
    return nb::make_tuple(nb::bytes(reinterpret_cast<const char *>(&p), sizeof p), nb::bytes(reinterpret_cast<const char *>(&b), sizeof b));
}

// Force, potential and bounds of a law at many points, from the same text as in a step.
static void law_values(int law, nb::dict arrays) {
    Arguments a(arrays, "arrays");
    if (law < 0 || law >= plain::LAWS) throw nb::value_error("law: must be the number of a law");
    const size_t count = a.length("x"), numbers = a.length("numbers");
    const double *x = a.array<double>("x", {count}), *y = a.array<double>("y", {count}), *P = a.array<double>("numbers", {numbers});
    double *force = a.array<double, true>("force", {count}, false), *potential = a.array<double, true>("potential", {count}, false);
    double *low = a.array<double, true>("low", {count}, false), *high = a.array<double, true>("high", {count}, false);
    double *stiffness = a.array<double, true>("stiffness", {count}, false), *damping = a.array<double, true>("damping", {count}, false);
    plain::with_law(law, [&](auto each) {
        if (int(numbers) < each.numbers) a.refuse("numbers", "has fewer numbers than the law");
        if (plain::of_user(law)) check_user(a, law, P, numbers);
        for (size_t i = 0; i < count; ++i) {
            force[i] = each.force(x[i], y[i], P), potential[i] = each.potential(x[i], P);
            low[i] = each.low(P), high[i] = each.high(P);
            stiffness[i] = each.stiffness(x[i], P), damping[i] = each.damping(x[i], y[i], P);
        }
    });
}

NB_MODULE(_core, m) {
    m.doc() = "The native core: integration of damped modes and scalar channels.";
    m.attr("SOURCES") = SNAPBEAM_SOURCES;
    m.attr("STATISTICS") = int(snapbeam::STATISTICS), m.attr("OF_CHANNEL") = int(snapbeam::OF_CHANNEL), m.attr("RUN_NUMBERS") = int(snapbeam::RUN_NUMBERS);
    std::vector<int> lossy;
    for (int law = 0; law < plain::LAWS; ++law)
        if (plain::with_law(law, [](auto each) { return bool(each.lossy); })) lossy.push_back(law);
    m.attr("LOSSY") = nb::cast(lossy);
    nb::list compositions;
    for (int number = 0; number < 3; ++number) {
        const auto c = plain::composition_of(number);
        nb::list flows, kicks;
        for (int i = 0; i < c.flows; ++i) flows.append(c.flow[c.which_flow(i)]);
        for (int i = 0; i <= c.flows; ++i) kicks.append(c.kick_weight(i));
        compositions.append(nb::make_tuple(flows, kicks));
    }
    m.attr("COMPOSITIONS") = compositions;
    m.def("integrate", &integrate, nb::arg("problem"), nb::arg("batch"), nb::arg("layout"), nb::arg("set"), nb::arg("threads"), nb::arg("progress").none());
    m.def("kick_parts", &plain::kick_parts<double>, nb::arg("composition"), nb::arg("decay"));
    m.attr("DIRECTIONS") = int(snapbeam::DIRECTIONS);
    m.def("integrate_tangents", &integrate_tangents, nb::arg("problem"), nb::arg("batch"), nb::arg("tangent"), nb::arg("set"), nb::arg("threads"), nb::arg("progress").none());
    m.def("record", &record, nb::arg("problem"), nb::arg("batch"), nb::arg("recorder"), nb::arg("layout"), nb::arg("set"));
    m.def("moved_arguments", &moved_arguments, nb::arg("problem"), nb::arg("batch"), nb::arg("moved"));
    m.def("law_values", &law_values, nb::arg("law"), nb::arg("arrays"));
    m.def("instruction_sets", [] {
        std::vector<std::string> names;
        for (const Set &each : sets()) names.push_back(each.name);
        return names;
    });
}
