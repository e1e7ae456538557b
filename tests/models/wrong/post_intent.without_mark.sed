# shm/base/counted_event.hpp: a post changes no mark, so nobody can tell whether it was made
s/\(before \+ kOnePost\) \^ kMark/before + kOnePost/
