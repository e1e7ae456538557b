#pragma once

#ifdef __cplusplus
extern "C" {
#endif

/// Null, if the mends of Cyclone's memory (instance_pin.h, told_keys.h) work in this process. Else they do
/// nothing, and this says why. Either plchost was built with a release whose internals it does not know, or
/// another library was loaded than the one that it was built with. Any thread.
const char* plc_unknown_cyclone(void);

#ifdef __cplusplus
}
#endif
