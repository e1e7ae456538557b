// A task that posts an event of another instance in each cycle.
#include <chrono>

#include "instances/plc_app.hpp"

namespace {

using namespace std::chrono_literals;

void setup(plc::Application& app) {
  app.cyclic("Feed", 12, 20ms, [product = app.open_event("packer1/product")] { (void)product.post(); });
}

}  // namespace

PLC_APPLICATION("Feeding", setup)
