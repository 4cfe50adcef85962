(** Must and no at a margin: what holds in a whole ball around a point.

    A robot is somewhere in the ball of radius [r] around its nominal position [p]. *)

Require Import Reals Lra Psatz.
From LtlPlan Require Import Vectors.
Open Scope R_scope.

(** ** Half-spaces n.x <= h; the rational [N] bounds |n| from above *)

Section HalfSpace.
  Variables (n : vec) (h N r : R) (p : vec).
  Hypothesis N_nonneg : 0 <= N.
  Hypothesis N_bound : dot n n <= N * N.
  Hypothesis r_nonneg : 0 <= r.

  Theorem half_space_must : dot n p <= h - N * r ->
    forall q, near r p q -> dot n q <= h.
  Proof. intros H q Hq; pose proof (reach n N r p q N_nonneg N_bound r_nonneg Hq); lra. Qed.

  Theorem half_space_no : h + N * r < dot n p ->
    forall q, near r p q -> h < dot n q.
  Proof. intros H q Hq; pose proof (reach n N r p q N_nonneg N_bound r_nonneg Hq); lra. Qed.
End HalfSpace.

(** ** Quadrics (x - c)'Q(x - c) <= B *)

(** A symmetric matrix: xx yy zz on the diagonal, xy xz yz beside it. *)
Record sym := Sym { xx : R; yy : R; zz : R; xy : R; xz : R; yz : R }.

Definition apply (Q : sym) (v : vec) : vec :=
  Vec (xx Q * vx v + xy Q * vy v + xz Q * vz v)
      (xy Q * vx v + yy Q * vy v + yz Q * vz v)
      (xz Q * vx v + yz Q * vy v + zz Q * vz v).

Definition form (Q : sym) (a b : vec) : R := dot a (apply Q b).
Definition quad (Q : sym) (a : vec) : R := form Q a a.

Definition semidefinite (Q : sym) : Prop := forall a, 0 <= quad Q a.

(** A square completed: with Q c = -l/2 the form x'Qx + l.x is (x - c)'Q(x - c) - c'Qc. *)
Theorem square_completed : forall Q l c x, apply Q c = scale (- / 2) l ->
  quad Q x + dot l x = quad Q (sub x c) - quad Q c /\ quad Q c = - dot l c / 2.
Proof.
  intros Q [l1 l2 l3] [c1 c2 c3] [x1 x2 x3] E; unfold apply, scale in E; simpl in E.
  injection E as E1 E2 E3; unfold quad, form, dot, apply, sub; simpl.
  assert (L1 : l1 = - 2 * (xx Q * c1 + xy Q * c2 + xz Q * c3)) by lra.
  assert (L2 : l2 = - 2 * (xy Q * c1 + yy Q * c2 + yz Q * c3)) by lra.
  assert (L3 : l3 = - 2 * (xz Q * c1 + yz Q * c2 + zz Q * c3)) by lra.
  rewrite L1, L2, L3; split; field.
Qed.

(** The trace bounds what a quadric grows by, as does any bound on its eigenvalues. *)
Definition grows_at_most (Q : sym) (L : R) : Prop := forall a, quad Q a <= L * dot a a.

(** [L] bounds the eigenvalues where L*1 - Q is semidefinite. *)
Definition rest (Q : sym) (L : R) : sym :=
  Sym (L - xx Q) (L - yy Q) (L - zz Q) (- xy Q) (- xz Q) (- yz Q).

Lemma rest_grows : forall Q L, semidefinite (rest Q L) -> grows_at_most Q L.
Proof.
  intros Q L H a; specialize (H a).
  assert (E : quad (rest Q L) a = L * dot a a - quad Q a)
    by (destruct a; unfold quad, form, dot, apply; simpl; ring).
  lra.
Qed.

Theorem rows_grow : forall Q L,
  Rabs (xx Q) + Rabs (xy Q) + Rabs (xz Q) <= L ->
  Rabs (xy Q) + Rabs (yy Q) + Rabs (yz Q) <= L ->
  Rabs (xz Q) + Rabs (yz Q) + Rabs (zz Q) <= L -> grows_at_most Q L.
Proof.
  assert (P : forall k x y, 2 * (k * (x * y)) <= Rabs k * (x * x + y * y)).
  { intros k x y; pose proof (Rle_abs k); pose proof (Rle_abs (- k)).
    rewrite Rabs_Ropp in *.
    assert (0 <= (Rabs k - k) * ((x + y) * (x + y)))
      by (apply Rmult_le_pos; [lra | apply square_nonneg]).
    assert (0 <= (Rabs k + k) * ((x - y) * (x - y)))
      by (apply Rmult_le_pos; [lra | apply square_nonneg]).
    lra. }
  intros Q L H1 H2 H3 [x y z]; unfold quad, form, dot, apply; simpl.
  pose proof (P (xy Q) x y); pose proof (P (xz Q) x z); pose proof (P (yz Q) y z).
  pose proof (Rle_abs (xx Q)); pose proof (Rle_abs (yy Q)); pose proof (Rle_abs (zz Q)).
  assert (0 <= x * x) by nra. assert (0 <= y * y) by nra. assert (0 <= z * z) by nra.
  nra.
Qed.

(** Cauchy and Schwarz for a semidefinite form. *)
Lemma form_bound : forall Q a b, semidefinite Q ->
  form Q a b * form Q a b <= quad Q a * quad Q b.
Proof.
  intros Q a b H.
  assert (E : forall s t, quad Q (add (scale s a) (scale t b))
    = s * s * quad Q a + 2 * (s * t) * form Q a b + t * t * quad Q b)
    by (intros; destruct a, b; unfold quad, form, dot, apply, add, scale; simpl; ring).
  assert (P : forall s t, 0 <= s * s * quad Q a + 2 * (s * t) * form Q a b + t * t * quad Q b)
    by (intros; rewrite <- E; apply H).
  pose proof (H a) as Ha; pose proof (H b) as Hb.
  set (f := form Q a b) in *; set (A := quad Q a) in *; set (B := quad Q b) in *.
  destruct (Req_dec B 0) as [Z|NZ].
  - destruct (Req_dec f 0) as [F|F]; [rewrite F; nra|].
    specialize (P 1 (- (A + 1) / (2 * f))).
    replace (1 * 1 * A + 2 * (1 * (- (A + 1) / (2 * f))) * f
      + - (A + 1) / (2 * f) * (- (A + 1) / (2 * f)) * B) with (-1) in P
      by (rewrite Z; field; auto). lra.
  - specialize (P B (- f)).
    replace (B * B * A + 2 * (B * - f) * f + - f * - f * B) with (B * (A * B - f * f)) in P by ring.
    assert (0 < B) by lra. nra.
Qed.

(** Minkowski: square roots of the form keep the triangle inequality. *)
Lemma quad_add_le : forall Q a d u e, semidefinite Q -> 0 <= u -> 0 <= e ->
  quad Q a <= u * u -> quad Q d <= e * e -> quad Q (add a d) <= (u + e) * (u + e).
Proof.
  intros Q a d u e H Hu He Ha Hd.
  assert (E : quad Q (add a d) = quad Q a + 2 * form Q a d + quad Q d)
    by (destruct a, d; unfold quad, form, dot, apply; simpl; ring).
  assert (B : - (u * e) <= form Q a d <= u * e).
  { apply square_le; [nra|]. apply Rle_trans with (1 := form_bound Q a d H).
    replace (u * e * (u * e)) with ((u * u) * (e * e)) by ring.
    apply Rmult_le_compat; auto. }
  nra.
Qed.

Section Quadric.
  (** The rationals: [s * s] bounds the eigenvalues, [b * b] bounds [B]. *)
  Variables (Q : sym) (c p : vec) (B b s r : R).
  Hypothesis Q_semidefinite : semidefinite Q.
  Hypothesis s_nonneg : 0 <= s.
  Hypothesis s_bound : grows_at_most Q (s * s).
  Hypothesis r_nonneg : 0 <= r.

  Let step q := sub q p.

  Lemma step_small : forall q, near r p q -> quad Q (step q) <= s * r * (s * r).
  Proof.
    intros q H; unfold near in H; pose proof (s_bound (step q)).
    assert (0 <= s * s) by nra. unfold step in *; nra.
  Qed.

  Theorem quadric_must : s * r <= b -> b * b <= B ->
    quad Q (sub p c) <= (b - s * r) * (b - s * r) ->
    forall q, near r p q -> quad Q (sub q c) <= B.
  Proof.
    intros Hb HB H q Hq.
    replace (sub q c) with (add (sub p c) (step q))
      by (unfold step, add, sub; simpl; f_equal; ring).
    pose proof (quad_add_le Q (sub p c) (step q) (b - s * r) (s * r)) as A.
    pose proof (step_small q Hq). assert (0 <= s * r) by nra.
    replace (b - s * r + s * r) with b in A by ring.
    apply Rle_trans with (2 := HB); apply A; auto; lra.
  Qed.

  Theorem quadric_no : 0 <= b -> B <= b * b ->
    (b + s * r) * (b + s * r) < quad Q (sub p c) ->
    forall q, near r p q -> B < quad Q (sub q c).
  Proof.
    intros Hb HB H q Hq; apply Rnot_le_lt; intros N.
    assert (G : quad Q (sub p c) <= (b + s * r) * (b + s * r)); [|lra].
    replace (sub p c) with (add (sub q c) (sub p q))
      by (unfold add, sub; simpl; f_equal; ring).
    assert (0 <= s * r) by nra.
    apply quad_add_le; auto; [lra|].
    replace (quad Q (sub p q)) with (quad Q (step q))
      by (unfold step, quad, form, dot, apply, sub; simpl; ring).
    apply step_small; auto.
  Qed.
End Quadric.
