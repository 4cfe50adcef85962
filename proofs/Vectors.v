(** Points in space and the dot product. *)

Require Import Reals Lra Psatz.
Open Scope R_scope.

Record vec := Vec { vx : R; vy : R; vz : R }.

Definition dot (a b : vec) : R := vx a * vx b + vy a * vy b + vz a * vz b.
Definition add (a b : vec) : vec := Vec (vx a + vx b) (vy a + vy b) (vz a + vz b).
Definition sub (a b : vec) : vec := Vec (vx a - vx b) (vy a - vy b) (vz a - vz b).
Definition scale (k : R) (a : vec) : vec := Vec (k * vx a) (k * vy a) (k * vz a).
Definition zero : vec := Vec 0 0 0.

(** [q] lies within [r] of [p]. *)
Definition near (r : R) (p q : vec) : Prop := dot (sub q p) (sub q p) <= r * r.

Lemma square_nonneg : forall x, 0 <= x * x.
Proof. intros x; pose proof (Rle_0_sqr x); unfold Rsqr in *; lra. Qed.

Lemma dot_square : forall a, 0 <= dot a a.
Proof. intros [x y z]; unfold dot; simpl; nra. Qed.

Lemma dot_add : forall n a b, dot n (add a b) = dot n a + dot n b.
Proof. intros; unfold dot; simpl; ring. Qed.

Lemma dot_sub : forall n a b, dot n (sub a b) = dot n a - dot n b.
Proof. intros; unfold dot; simpl; ring. Qed.

Lemma cauchy_schwarz : forall a b, dot a b * dot a b <= dot a a * dot b b.
Proof.
  intros [a1 a2 a3] [b1 b2 b3]; unfold dot; simpl.
  pose proof (Rle_0_sqr (a1 * b2 - a2 * b1)).
  pose proof (Rle_0_sqr (a1 * b3 - a3 * b1)).
  pose proof (Rle_0_sqr (a2 * b3 - a3 * b2)). unfold Rsqr in *; nra.
Qed.

(** A square root bounded without roots. *)
Lemma square_le : forall x y, 0 <= y -> x * x <= y * y -> - y <= x <= y.
Proof. intros x y Hy H; split; nra. Qed.

(** Along [n] a ball of radius [r] reaches at most [N r], where [N] bounds |n|. *)
Lemma reach : forall n N r p q, 0 <= N -> dot n n <= N * N -> 0 <= r -> near r p q ->
  dot n p - N * r <= dot n q <= dot n p + N * r.
Proof.
  intros n N r p q HN Hn Hr H; unfold near in H.
  pose proof (cauchy_schwarz n (sub q p)) as CS.
  pose proof (dot_square (sub q p)); pose proof (dot_square n).
  assert (B : - (N * r) <= dot n (sub q p) <= N * r).
  { apply square_le; [nra|]. apply Rle_trans with (1 := CS).
    replace (N * r * (N * r)) with ((N * N) * (r * r)) by ring.
    apply Rmult_le_compat; auto. }
  rewrite dot_sub in B; lra.
Qed.
