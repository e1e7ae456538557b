// The access control plugin of the system, with its checks of what the own process may do switched off. So a
// client creates and announces whatever it likes, and only others can refuse it.
// Not dds_security_api.h, which is no C++.
struct ddsi_domaingv;
#include <dds/security/dds_security_api_access_control.h>
#include <dlfcn.h>

namespace {

using Init = int (*)(const char*, void**, struct ddsi_domaingv*);
using Finalize = int (*)(void*);

template <class Function>
Function in_plugin(const char* name) {
  static void* const plugin = ::dlopen(ACCESS_CONTROL_PLUGIN, RTLD_NOW);
  return plugin == nullptr ? nullptr : reinterpret_cast<Function>(::dlsym(plugin, name));
}

template <class... Arguments>
DDS_Security_boolean allow(Arguments... /*anything*/) {
  return 1;
}

}  // namespace

extern "C" int init_access_control(const char* argument, void** context, struct ddsi_domaingv* domain) {
  const auto init = in_plugin<Init>("init_access_control");
  if (init == nullptr) return -1;
  const int result = init(argument, context, domain);
  if (result != 0) return result;
  auto* const plugin = static_cast<dds_security_access_control*>(*context);
  plugin->check_create_participant = allow;
  plugin->check_create_datawriter = allow;
  plugin->check_create_datareader = allow;
  plugin->check_create_topic = allow;
  plugin->check_remote_datawriter = allow;
  plugin->check_local_datawriter_match = allow;
  plugin->check_local_datareader_match = allow;
  plugin->check_remote_topic = allow;
  return result;
}

extern "C" int finalize_access_control(void* context) {
  const auto finalize = in_plugin<Finalize>("finalize_access_control");
  return finalize == nullptr ? -1 : finalize(context);
}
