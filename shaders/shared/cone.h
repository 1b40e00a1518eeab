// Requests and results of cone queries.
#ifndef RTSTDB_SHARED_CONE_H
#define RTSTDB_SHARED_CONE_H
#include "shared/interop.h"

// Equals max_returns_per_cone of rtstdb/limits.hpp.
RTSTDB_CONSTANT(max_returns, 8)
// The nearest entities, among which a beam is distributed; equals max_entities_per_beam of rtstdb/limits.hpp.
// One more contact is searched: it shows whether there are further entities, and where they begin.
RTSTDB_CONSTANT(beam_entities, 16)
RTSTDB_CONSTANT(beam_contacts, 17)
// The directions along which a beam is sampled.
RTSTDB_CONSTANT(beam_directions, 64)

#define RTSTDB_FIELDS_ConeRecord(F)                                \
  F(vec3, apex_m)                                                  \
  F(float, lambda_max)                                             \
  F(vec3, direction)                                               \
  F(float, sine) /* of half the opening angle; 0: a ray */         \
  F(float, cosine)                                                 \
  F(float, tangent)                                                \
  F(int, t_ns) /* since the epoch of the instances that it sees */ \
  F(uint, mask)                                                    \
  F(uint, carrier)       /* place of its instance, or no_entity */ \
  F(uint, instance_base) /* 0 or late_base */                      \
  F(float, share)        /* of the window that has passed */       \
  F(uint, place)         /* where its answer belongs */
RTSTDB_STRUCT(ConeRecord)

#define RTSTDB_FIELDS_ConeCount(F) \
  F(uint, found)                   \
  F(uint, incomplete)              \
  F(uint, overflow)
RTSTDB_STRUCT(ConeCount)

// The first contact with an entity, by ascending lambda, beam_contacts for each cone. `lambda` is that of the
// scaled direction (TracedRay).
#define RTSTDB_FIELDS_ConeContact(F) \
  F(uint, instance)                  \
  F(uint, slot)                      \
  F(float, lambda)
RTSTDB_STRUCT(ConeContact)

// A bit of ConeContact::slot, whose numbers are below 2^26: a distance field was used for the contact.
RTSTDB_CONSTANT(contact_by_field_bit, 0x80000000u)

// A return in the layout of the caller (rtstdb::ConeReturn), 9 pairs of words:
//   0 status, lambda    3 mask, material           5 normal xy                       8 fraction, -
//   1 u, v              4 triangle, front face     6 normal z, relative velocity x
//   2 entity            (low byte), overflow and   7 relative velocity yz
//                       found by a field
RTSTDB_CONSTANT(return_pairs, 9)
RTSTDB_CONSTANT(return_overflow_bit, 0x100u)
RTSTDB_CONSTANT(return_by_field_bit, 0x10000u)

#define RTSTDB_FIELDS_ConeArgs(F)                      \
  F(uint, root)                                        \
  F(uint, first) /* see place_of_invocation */         \
  F(uint, end)                                         \
  F(uint, per_group)                                   \
  F(uint, entities) /* listed for each cone */         \
  F(uint, returns_per_cone)                            \
  F(float, faces)    /* as in RayArgs */               \
  F(uvec2, returns)  /* their address, low word first */ \
  F(uvec2, contacts) /* the same */                    \
  F(uvec2, halt) /* this and the next as in RayArgs */ \
  F(uint, halt_from)                                   \
  F(uint, loop_probe) /* see loops_still_turn */
RTSTDB_STRUCT(ConeArgs)

#endif
