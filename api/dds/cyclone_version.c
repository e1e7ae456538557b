#include "api/dds/cyclone_version.h"

#include <dds/version.h>
#include <dlfcn.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

static const char* reason;

// A library tells its release by nothing but the name of its file. Debian's all have the same soname.
static void look(void) {
  reason = "the Cyclone DDS that was loaded is not release " DDS_VERSION ", with which plchost was built";
  Dl_info library;
  void* const function = dlsym(RTLD_DEFAULT, "dds_create_domain");
  if (function == NULL || dladdr(function, &library) == 0) return;
  char* const file = realpath(library.dli_fname, NULL);
  if (file == NULL) return;
  const char* const name = strrchr(file, '/');
  if (name != NULL && strcmp(name, "/libddsc.so." DDS_VERSION) == 0) reason = NULL;
  free(file);
}

const char* plc_unknown_cyclone(void) {
  static pthread_once_t once = PTHREAD_ONCE_INIT;
  (void)pthread_once(&once, look);
  return reason;
}
