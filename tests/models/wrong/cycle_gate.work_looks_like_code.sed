# schedulers/faults/cycle_gate.hpp: work of the runtime looks like code of the application
s/if \(word <= kWithin\) return/if (word == kOutside || word == kWithin) return/
