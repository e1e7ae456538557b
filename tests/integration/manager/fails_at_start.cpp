// Passes its trial and refuses to start: a fault that no trial can find.
#include <chrono>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>

#include "instances/plc_app.hpp"

namespace {

bool is_tried() {
  std::ifstream file("/proc/self/cmdline");
  const std::string line(std::istreambuf_iterator<char>(file), {});
  return line.find("--check-application") != std::string::npos;
}

void setup(plc::Application& app) {
  app.cyclic("Main", 1, std::chrono::milliseconds(10), [] {});
  if (!is_tried()) throw std::runtime_error("no valve answers");
}

}  // namespace

PLC_APPLICATION("FailsAtStart", setup)
