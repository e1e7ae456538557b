/*
 * A reference clock in software: firmware in plain C that needs nothing of plchost but one header. It invents
 * a clock that drifts against CLOCK_MONOTONIC and writes pairs of stamps into the reference record, with
 * noise, wild pairs, steps and drop-outs on demand. See README.md, or --help.
 */
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "plc_reference_clock.h"

#define NS_PER_S 1000000000L
#define EPOCH_NS 800000000000000000L /* 25 years after the zero of EtherCAT's clock */

struct options {
  const char* pool;
  const char* name;
  double drift_ppm;  /* the reference runs this much faster than CLOCK_MONOTONIC */
  double wander_ppm; /* and this much more and less, in a sine of wander_s */
  double wander_s;
  double noise_ns;  /* evenly spread, either way */
  double offset_us; /* phase at the begin against CLOCK_MONOTONIC's milliseconds */
  double rate_hz;
  double step_us; /* the reference jumps by that, every step_s */
  double step_s;
  double wild_percent; /* of pairs that are off by up to 10 ms */
  double dropout_s;    /* of every dropout_every_s nothing is written */
  double dropout_every_s;
  int invalid; /* in a drop-out: writes "not valid" instead of nothing */
  double seconds;
  double seed;
};

static struct options options = {"plchost", "reference", 100, 0, 0, 200, 0, 1000, 0, 0, 0, 0, 0, 0, 0, 1};

struct number_option {
  const char* name;
  double* value;
  double lowest;
  double highest;
  const char* help;
};

static const struct number_option numbers[] = {
    {"--drift", &options.drift_ppm, -200, 200, "ppm by which the reference is faster than CLOCK_MONOTONIC"},
    {"--wander", &options.wander_ppm, 0, 200, "ppm more and less, in a sine"},
    {"--wander-period", &options.wander_s, 0, 1e6, "s, of that sine; 0: off"},
    {"--noise", &options.noise_ns, 0, 1e9, "ns either way, on each pair"},
    {"--offset", &options.offset_us, -1e9, 1e9, "us, phase at the begin"},
    {"--rate", &options.rate_hz, 1, 20000, "pairs per second"},
    {"--step", &options.step_us, -1e9, 1e9, "us that the reference jumps by"},
    {"--step-every", &options.step_s, 0, 1e6, "s between two such steps; 0: none"},
    {"--wild", &options.wild_percent, 0, 100, "percent of pairs that are off by up to 10 ms"},
    {"--dropout", &options.dropout_s, 0, 1e6, "s of a drop-out"},
    {"--dropout-every", &options.dropout_every_s, 0, 1e6, "s between the ends of two of them; 0: none"},
    {"--seconds", &options.seconds, 0, 1e9, "s to run; 0: until it is ended"},
    {"--seed", &options.seed, 0, 1e15, "of the noise"},
};
#define NUMBERS (sizeof numbers / sizeof numbers[0])

static volatile sig_atomic_t ending = 0;

static void on_signal(int number) {
  (void)number;
  ending = 1;
}

/* xorshift*: the same noise for the same seed everywhere. Evenly in -1 to 1. */
static double random_unit(unsigned long* state) {
  *state ^= *state >> 12;
  *state ^= *state << 25;
  *state ^= *state >> 27;
  return (double)((*state * 0x2545f4914f6cdd1dUL) >> 11) * (2.0 / 9007199254740992.0) - 1.0;
}

/* The reference's time beyond EPOCH_NS, `elapsed_s` after the begin. */
static double reference_ns(double elapsed_s) {
  double ns = elapsed_s * 1e9 * (1.0 + options.drift_ppm * 1e-6) + options.offset_us * 1e3;
  if (options.wander_s > 0) {
    const double omega = 2 * 3.14159265358979323846 / options.wander_s;
    ns += options.wander_ppm * 1e3 / omega * (1.0 - cos(omega * elapsed_s));
  }
  if (options.step_s > 0) ns += floor(elapsed_s / options.step_s) * options.step_us * 1e3;
  return ns;
}

static int in_dropout(double elapsed_s) {
  if (options.dropout_every_s <= 0) return 0;
  /* The first one comes at the end of the first span. */
  return fmod(elapsed_s, options.dropout_every_s) >= options.dropout_every_s - options.dropout_s;
}

static void sleep_until(plc_clock_i64 when_ns) {
  struct timespec when;
  when.tv_sec = when_ns / NS_PER_S;
  when.tv_nsec = when_ns % NS_PER_S;
  while (!ending && clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &when, NULL) == EINTR) {
  }
}

static void run(plc_reference_clock* clock) {
  const plc_clock_i64 interval = (plc_clock_i64)(1e9 / options.rate_hz);
  const plc_clock_i64 begin = plc_reference_clock_local_ns() / 1000000L * 1000000L;
  plc_clock_i64 next = begin + 1000000L;
  unsigned long random = (unsigned long)options.seed * 2 + 1;
  unsigned long pairs = 0;
  while (!ending) {
    plc_clock_i64 local;
    double elapsed_s, reference;
    sleep_until(next);
    next += interval;
    /* One instant, two clocks: the reference is computed from the very stamp, so only the noise is off. */
    local = plc_reference_clock_local_ns();
    elapsed_s = (double)(local - begin) * 1e-9;
    if (options.seconds > 0 && elapsed_s >= options.seconds) break;
    reference = reference_ns(elapsed_s) + random_unit(&random) * options.noise_ns;
    if ((random_unit(&random) + 1) * 50 < options.wild_percent) reference += random_unit(&random) * 1e7;
    if (in_dropout(elapsed_s)) {
      if (options.invalid) plc_reference_clock_write(clock, 0, local, 0);
      continue;
    }
    plc_reference_clock_write(clock, EPOCH_NS + (plc_clock_i64)floor(reference + 0.5), local, 1);
    ++pairs;
  }
  printf("%lu pairs written\n", pairs);
}

static int usage(FILE* to) {
  size_t i;
  fprintf(
      to,
      "reference_clock [OPTIONS]: writes the stamps of an invented clock into a reference record of plchost\n"
      "  --pool NAME             pool of the host (plchost)\n"
      "  --name NAME             name of the record: [DistributedClock] Reference=NAME (reference)\n"
      "  --invalid               in a drop-out write \"not valid\" instead of nothing\n");
  for (i = 0; i < NUMBERS; ++i) {
    fprintf(to, "  %-17s N     %s (%g)\n", numbers[i].name, numbers[i].help, *numbers[i].value);
  }
  return to == stdout ? 0 : 2;
}

static int read_number(const char* name, const char* text) {
  size_t i;
  for (i = 0; i < NUMBERS; ++i) {
    char* end = NULL;
    double value;
    if (strcmp(numbers[i].name, name) != 0) continue;
    value = strtod(text, &end);
    if (end == text || *end != '\0' || !(value >= numbers[i].lowest && value <= numbers[i].highest)) {
      fprintf(stderr, "reference_clock: %s '%s' is not allowed: a number from %g to %g is\n", name, text,
              numbers[i].lowest, numbers[i].highest);
      return 0;
    }
    *numbers[i].value = value;
    return 1;
  }
  fprintf(stderr, "reference_clock: there is no option '%s'; see --help\n", name);
  return 0;
}

int main(int argc, char** argv) {
  plc_reference_clock* clock = NULL;
  int i, error;
  for (i = 1; i < argc; ++i) {
    if (strcmp(argv[i], "--help") == 0) return usage(stdout);
    if (strcmp(argv[i], "--invalid") == 0) {
      options.invalid = 1;
    } else if (i + 1 == argc) {
      return usage(stderr);
    } else if (strcmp(argv[i], "--pool") == 0) {
      options.pool = argv[++i];
    } else if (strcmp(argv[i], "--name") == 0) {
      options.name = argv[++i];
    } else if (read_number(argv[i], argv[i + 1])) {
      ++i;
    } else {
      return 2;
    }
  }
  error = plc_reference_clock_open(options.pool, options.name, &clock);
  if (error != 0) {
    fprintf(stderr, "reference_clock: record '%s' of pool '%s': %s\n", options.name, options.pool,
            strerror(error));
    return 1;
  }
  signal(SIGINT, on_signal);
  signal(SIGTERM, on_signal);
  run(clock);
  plc_reference_clock_close(clock);
  return 0;
}
