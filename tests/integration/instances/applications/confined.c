/*
 * Tries the calls that a filter may refuse, and says the errno of each. It starts a program as it is loaded.
 * It makes sockets in its set-up, in a cycle and in a thread of its own. "own socket 0": those of its set-up
 * carry data in a cycle.
 */
#include <errno.h>
#include <pthread.h>
#include <stdio.h>
#include <sys/socket.h>
#include <unistd.h>

#include "../../../../instances/plc_app.h"

static int program;
static int own[2];
static int has_run;
static volatile int runs;

static void say(const char* what, int error) {
  char text[PLC_LOG_MAX_TEXT];
  (void)snprintf(text, sizeof text, "%s %d", what, error);
  plc_log(PLC_LOG_INFO, text);
}

/* If that is allowed, a shell is in the place of the instance. */
__attribute__((constructor)) static void start_program(void) {
  errno = 0;
  (void)execl("/bin/sh", "sh", "-c", "exit 7", (char*)NULL);
  program = errno;
}

static int error_of_socket(void) {
  const int made = socket(AF_INET, SOCK_STREAM, 0);
  if (made < 0) return errno;
  (void)close(made);
  return 0;
}

static void* look_when_it_runs(void* argument) {
  while (!runs) (void)usleep(1000);
  say("socket of a thread", error_of_socket());
  return argument;
}

static void cycle(void) {
  char byte = 'x';
  if (has_run) return;
  has_run = 1;
  runs = 1;
  say("socket in a cycle", error_of_socket());
  say("own socket", send(own[0], &byte, 1, 0) == 1 && recv(own[1], &byte, 1, 0) == 1 ? 0 : errno);
}

static Task_Info task = {"Main", 1, Cyclic, 0, 10, 0, "", cycle, 0, 0, 0, 0, 0, 0};
static sys_setup_tasks_struct setup = {1, "Confined", &task};

PLC_EXPORT_ABI;

int plc_app_init(void) {
  pthread_t thread;
  say("program", program);
  say("socket in the set-up", socketpair(AF_UNIX, SOCK_STREAM, 0, own) == 0 ? 0 : errno);
  if (pthread_create(&thread, NULL, look_when_it_runs, NULL) != 0) return 1;
  (void)pthread_detach(thread);
  __sys__setup__tasks(&setup);
  return 0;
}
