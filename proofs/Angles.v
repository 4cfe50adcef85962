(** A rational number above a cosine. *)

Require Import Reals Lra Lia.
Open Scope R_scope.

(** The alternating sum 1 - x^2/2! + x^4/4! - ... that ends with a plus. *)
Theorem cosine_above : forall a n, 0 <= a <= 2 -> cos a <= cos_approx a (2 * (n + 1)).
Proof. intros a n H; apply (pre_cos_bound a n); lra. Qed.
