# schedulers/faults/cycle_gate.hpp: work of the runtime looks like code of the application
# caught as: code runs since a time that nobody has given
s/if \(word <= kWithin\) return/if (word == kOutside || word == kWithin) return/
