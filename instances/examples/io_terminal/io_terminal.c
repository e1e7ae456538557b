/*
 * A simulated I/O terminal as firmware, in a process of its own: 64 output channels of an instance that it
 * drives, and 64 input channels that it measures. Each input follows the output of the same number, as a
 * motor follows its set point. See README.md.
 */
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "plc_process_image.h"

#define CHANNELS 64
#define NS_PER_MS 1000000L
#define NS_PER_S 1000000000L

typedef struct {
  const char* pool;
  const char* name;
  long cycle_us;
  long watchdog_ms;
  long seconds;
} options_t;

typedef struct {
  unsigned short channel[CHANNELS];
} channels_t;

typedef struct {
  unsigned long cycles;
  unsigned long images; /* different ones that were read */
  unsigned long busy;   /* readings that were overtaken each time */
  unsigned int state;   /* of the instance: PLC_IMAGE_STATE_... */
  int safe;             /* outputs are in their safe state */
} figures_t;

static volatile sig_atomic_t ending = 0;

static void end(int signal_number) {
  (void)signal_number;
  ending = 1;
}

static int usage(FILE* to) {
  fprintf(to,
          "io_terminal [--pool NAME] [--name NAME] [--cycle US] [--watchdog MS] [--seconds S]\n"
          "  drives the outputs in the shared memory NAME.out of the pool, and measures into NAME.in\n");
  return to == stdout ? 0 : 2;
}

static int read_options(int argc, char** argv, options_t* options) {
  int i;
  for (i = 1; i < argc; i += 2) {
    char* stop = NULL;
    long number;
    if (i + 1 >= argc) return usage(stderr);
    number = strtol(argv[i + 1], &stop, 10);
    if (strcmp(argv[i], "--pool") == 0) {
      options->pool = argv[i + 1];
    } else if (strcmp(argv[i], "--name") == 0) {
      options->name = argv[i + 1];
    } else if (*stop != '\0' || number < 1 || number > 1000000) {
      return usage(stderr);
    } else if (strcmp(argv[i], "--cycle") == 0) {
      options->cycle_us = number;
    } else if (strcmp(argv[i], "--watchdog") == 0) {
      options->watchdog_ms = number;
    } else if (strcmp(argv[i], "--seconds") == 0) {
      options->seconds = number;
    } else {
      return usage(stderr);
    }
  }
  return 0;
}

static int open_image(const options_t* options, const char* direction, int access, plc_image* image) {
  char name[128];
  int error;
  if (snprintf(name, sizeof name, "%s.%s", options->name, direction) >= (int)sizeof name) return ENAMETOOLONG;
  error = plc_image_open(options->pool, name, sizeof(channels_t), access, image);
  if (error != 0) fprintf(stderr, "io_terminal: %s in pool %s: %s\n", name, options->pool, strerror(error));
  return error;
}

/* The outputs of the PLC, or all off if it is silent. While its tasks do not run, the image that is read is
 * the safe one of its settings. */
static void read_outputs(const options_t* options, const plc_image* image, channels_t* outputs,
                         figures_t* figures) {
  static plc_image_u64 last = 0;
  channels_t fresh;
  switch (plc_image_read(image, &fresh, NULL)) {
    case PLC_IMAGE_OK:
      if (plc_image_sequence(image) != last) ++figures->images;
      last = plc_image_sequence(image);
      *outputs = fresh;
      break;
    case PLC_IMAGE_BUSY:
      ++figures->busy; /* those of before hold */
      break;
    default:
      break;
  }
  figures->state = plc_image_state(image);
  figures->safe = figures->state != PLC_IMAGE_STATE_RUNNING;
  /* Nobody drives the outputs, nor has put them into their safe state: the process was killed and there is no
   * manager, or it stands still. */
  if (plc_image_silence_ns(image) > options->watchdog_ms * NS_PER_MS) {
    figures->safe = 1;
    memset(outputs, 0, sizeof *outputs);
  }
}

/* Each input comes a quarter of the way nearer to its output. */
static void measure(const channels_t* outputs, channels_t* inputs) {
  int i;
  for (i = 0; i < CHANNELS; ++i) {
    const int distance = (int)outputs->channel[i] - (int)inputs->channel[i];
    const int step = distance / 4 != 0 ? distance / 4 : distance;
    inputs->channel[i] = (unsigned short)((int)inputs->channel[i] + step);
  }
}

static const char* name_of(unsigned int state) {
  static const char* const names[] = {"not there", "running", "stopped", "in exception", "halted", "ended"};
  return state < sizeof names / sizeof names[0] ? names[state] : "in an unknown state";
}

static void report(const channels_t* inputs, const channels_t* outputs, const figures_t* figures) {
  int i;
  printf("cycles %lu, images %lu, busy %lu, PLC %s, %s; channel out/in:", figures->cycles, figures->images,
         figures->busy, name_of(figures->state), figures->safe ? "safe state" : "driven");
  for (i = 0; i < 4; ++i) printf(" %u/%u", outputs->channel[i], inputs->channel[i]);
  printf("\n");
  fflush(stdout);
}

static void run(const options_t* options, const plc_image* inputs, const plc_image* outputs) {
  channels_t driven;
  channels_t measured;
  figures_t figures;
  struct timespec next;
  const unsigned long per_second = (unsigned long)(1000000L / options->cycle_us);
  const plc_image_i64 begin = plc_image_now_ns();
  memset(&driven, 0, sizeof driven);
  memset(&measured, 0, sizeof measured);
  memset(&figures, 0, sizeof figures);
  clock_gettime(CLOCK_MONOTONIC, &next);
  while (!ending && (options->seconds == 0 || plc_image_now_ns() - begin < options->seconds * NS_PER_S)) {
    read_outputs(options, outputs, &driven, &figures);
    measure(&driven, &measured);
    plc_image_write(inputs, &measured);
    ++figures.cycles;
    if (figures.cycles % (per_second == 0 ? 1 : per_second) == 0) report(&measured, &driven, &figures);
    next.tv_nsec += options->cycle_us % 1000000L * 1000L;
    next.tv_sec += options->cycle_us / 1000000L + next.tv_nsec / NS_PER_S;
    next.tv_nsec %= NS_PER_S;
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &next, NULL);
  }
  report(&measured, &driven, &figures);
}

int main(int argc, char** argv) {
  options_t options;
  plc_image inputs;
  plc_image outputs;
  struct sigaction action;
  int wrong;
  options.pool = "plchost";
  options.name = "terminal1";
  options.cycle_us = 1000;
  options.watchdog_ms = 100;
  options.seconds = 0;
  if (argc == 2 && strcmp(argv[1], "--help") == 0) return usage(stdout);
  wrong = read_options(argc, argv, &options);
  if (wrong != 0) return wrong;
  memset(&action, 0, sizeof action);
  action.sa_handler = end;
  sigaction(SIGTERM, &action, NULL);
  sigaction(SIGINT, &action, NULL);
  if (open_image(&options, "out", PLC_IMAGE_READ, &outputs) != 0) return 1;
  if (open_image(&options, "in", PLC_IMAGE_WRITE, &inputs) != 0) return 1;
  run(&options, &inputs, &outputs);
  plc_image_close(&inputs);
  plc_image_close(&outputs);
  return 0;
}
