// Copies the inputs of two devices, inverted, to their outputs. User bits say which is which: 0x1000 and
// 0x2000 the one, 0x4000 and 0x8000 the other.
#include <chrono>

#include "../../../../instances/plc_app.hpp"

namespace {

struct Channels {
  unsigned char bytes[64];
};

plc::Area<Channels> inputs[2];
plc::Area<Channels> outputs[2];

void mirror() {
  for (int device = 0; device < 2; ++device) {
    for (unsigned channel = 0; channel < sizeof(Channels); ++channel) {
      outputs[device]->bytes[channel] = static_cast<unsigned char>(~inputs[device]->bytes[channel]);
    }
  }
}

void setup(plc::Application& app) {
  app.cyclic("Mirror", 4, std::chrono::milliseconds(10), mirror);
  inputs[0] = app.area<Channels>("uio.in", PLC_AREA_INPUT | 0x1000);
  outputs[0] = app.area<Channels>("uio.out", PLC_AREA_OUTPUT | 0x2000);
  inputs[1] = app.area<Channels>("mem.in", PLC_AREA_INPUT | 0x4000);
  outputs[1] = app.area<Channels>("mem.out", PLC_AREA_OUTPUT | 0x8000);
}

}  // namespace

PLC_APPLICATION("DeviceMirror", setup)
