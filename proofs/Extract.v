(** The proved checkers as OCaml: `checkers.ml`, which `driver.ml` reads cases for. *)

From Coq Require Import Extraction ExtrOcamlBasic ZArith.
From LtlPlan Require Tree Progression Invariant.

Extraction Language OCaml.
Set Warnings "-extraction-opaque-accessed".
Extraction "checkers.ml"
  Z.add Z.mul Z.opp Tree.check_tree Progression.satisfies
  Invariant.check_joint Invariant.check_own.
