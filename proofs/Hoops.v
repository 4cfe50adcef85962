(** Hoops: openings that are passed or not met, and rims that are not met.

    A hoop has a centre [c] and a normal [n].  Of a place r, [along r] over |n| says how far
    it is from the opening's plane, and the root of [across r] over |n| how far from its axis. *)

Require Import Reals Lra Psatz.
From LtlPlan Require Import Vectors Margins.
Open Scope R_scope.

Section Hoop.
  Variables (n c : vec).

  Definition along (r : vec) : R := dot n (sub r c).

  (** |n|^2 - n n': its form is the squared distance from the axis, times |n|^2. *)
  Definition radial : sym :=
    Sym (dot n n - vx n * vx n) (dot n n - vy n * vy n) (dot n n - vz n * vz n)
        (- (vx n * vy n)) (- (vx n * vz n)) (- (vy n * vz n)).
  Definition across (r : vec) : R := quad radial (sub r c).

  Lemma radial_form : forall a, quad radial a = dot n n * dot a a - dot n a * dot n a.
  Proof. intros [x y z]; unfold quad, form, apply, radial, dot; destruct n; simpl; ring. Qed.

  Theorem across_form : forall r,
    across r = dot (sub r c) (sub r c) * dot n n - along r * along r.
  Proof. intros r; unfold across, along; rewrite radial_form; ring. Qed.

  Lemma radial_semidefinite : semidefinite radial.
  Proof. intros a; rewrite radial_form; pose proof (cauchy_schwarz n a); lra. Qed.

  Lemma radial_grows : grows_at_most radial (sqrt (dot n n) * sqrt (dot n n)).
  Proof.
    intros a; rewrite radial_form, sqrt_sqrt by apply dot_square.
    pose proof (square_nonneg (dot n a)); lra.
  Qed.

  Notation m := (sqrt (dot n n)).

  Lemma m_square : m * m = dot n n.
  Proof. apply sqrt_sqrt, dot_square. Qed.

  (** ** Openings *)

  (** [N] bounds |n|: on one side of the plane is all that is near. *)
  Theorem before_plane : forall N d p, 0 <= N -> dot n n <= N * N -> 0 <= d ->
    along p < - (d * N) -> forall q, near d p q -> along q < 0.
  Proof.
    intros N d p HN Hn Hd H q Hq; unfold along in *; rewrite dot_sub in *.
    pose proof (reach n N d p q HN Hn Hd Hq); lra.
  Qed.

  Theorem behind_plane : forall N d p, 0 <= N -> dot n n <= N * N -> 0 <= d ->
    d * N < along p -> forall q, near d p q -> 0 < along q.
  Proof.
    intros N d p HN Hn Hd H q Hq; unfold along in *; rewrite dot_sub in *.
    pose proof (reach n N d p q HN Hn Hd Hq); lra.
  Qed.

  Theorem beside_opening : forall opening d p, 0 <= opening -> 0 <= d ->
    (opening + d) * (opening + d) * dot n n < across p ->
    forall q, near d p q -> opening * opening * dot n n < across q.
  Proof.
    intros o d p Ho Hd H q Hq; unfold across in *; pose proof m_square as M.
    pose proof radial_grows as G; pose proof (sqrt_pos (dot n n)); set (k := m) in *; clearbody k.
    apply (quadric_no radial c p (o * o * dot n n) (o * k) k d); auto using radial_semidefinite; nra.
  Qed.

  Theorem inside_opening : forall opening d p, 0 <= d -> d <= opening ->
    across p <= (opening - d) * (opening - d) * dot n n ->
    forall q, near d p q -> across q <= opening * opening * dot n n.
  Proof.
    intros o d p Hd Ho H q Hq; unfold across in *; pose proof m_square as M.
    pose proof radial_grows as G; pose proof (sqrt_pos (dot n n)); set (k := m) in *; clearbody k.
    apply (quadric_must radial c p (o * o * dot n n) (o * k) k d); auto using radial_semidefinite; nra.
  Qed.

  (** Whoever comes from one side of the plane to the other, and is within the opening's
      cylinder meanwhile, goes through the disc, inside the rim. *)
  Theorem passes_disc : forall (q : R -> vec) a b opening, a < b -> continuity (fun t => along (q t)) ->
    along (q a) < 0 -> 0 < along (q b) ->
    (forall t, a <= t <= b -> across (q t) <= opening * opening * dot n n) ->
    exists t, a <= t <= b /\ along (q t) = 0 /\ across (q t) <= opening * opening * dot n n.
  Proof.
    intros q a b o Hab C A B I.
    destruct (IVT (fun t => along (q t)) a b C Hab A B) as (t & Ht & E); exists t; auto.
  Qed.

  (** ** Rims

      A ring of points around the axis: between two distances from it, and not far from the plane. *)
  Variables (opening rim : R).
  Hypothesis opening_nonneg : 0 <= opening.
  Hypothesis rim_nonneg : 0 <= rim.

  Definition in_rim (y : vec) : Prop :=
    along y * along y <= rim / 2 * (rim / 2) * dot n n /\
    opening * opening * dot n n <= across y <= (opening + rim) * (opening + rim) * dot n n.

  (** How far a place is away from the rim along the axis, and across it. *)
  Definition ahead (p : vec) (gap : R) : Prop :=
    (rim / 2 + gap) * (rim / 2 + gap) * dot n n < along p * along p.
  Definition aside (p : vec) (gap : R) : Prop :=
    (opening + rim + gap) * (opening + rim + gap) * dot n n < across p \/
    (gap < opening /\ across p < (opening - gap) * (opening - gap) * dot n n).

  Lemma squares_lt : forall a b, 0 <= b -> a * a < b * b -> - b < a < b.
  Proof. intros a b Hb H; split; apply Rnot_le_lt; intros L; nra. Qed.

  Lemma ahead_apart : forall p y gap, 0 <= gap -> ahead p gap -> in_rim y ->
    gap * gap * dot n n < dot n (sub p y) * dot n (sub p y).
  Proof.
    intros p y gap Hg A [R _]; unfold ahead in A; pose proof m_square as M.
    pose proof (sqrt_pos (dot n n)) as Hm; set (k := m) in *; clearbody k; rewrite <- M in *.
    assert (E : dot n (sub p y) = along p - along y) by (unfold along; rewrite !dot_sub; lra).
    rewrite E; set (u := along p) in *; set (v := along y) in *.
    assert (V : - (rim / 2 * k) <= v <= rim / 2 * k) by (apply square_le; nra).
    assert (G : 0 <= gap * k) by (apply Rmult_le_pos; auto).
    apply Rnot_le_lt; intros L.
    assert (D : - (gap * k) <= u - v <= gap * k) by (apply square_le; lra).
    assert (U : u * u <= (rim / 2 + gap) * (rim / 2 + gap) * (k * k)); [|lra].
    replace ((rim / 2 + gap) * (rim / 2 + gap) * (k * k))
      with ((rim / 2 * k + gap * k) * (rim / 2 * k + gap * k)) by ring.
    nra.
  Qed.

  Lemma aside_apart : forall p y gap, 0 <= gap -> aside p gap -> in_rim y ->
    gap * gap * dot n n < quad radial (sub p y).
  Proof.
    intros p y gap Hg A [_ [R1 R2]]; unfold aside, across in *; pose proof m_square as M.
    pose proof (sqrt_pos (dot n n)) as Hm; set (k := m) in *; clearbody k; rewrite <- M in *.
    apply Rnot_le_lt; intros L.
    assert (G : 0 <= gap * k) by (apply Rmult_le_pos; auto).
    destruct A as [A | [Lt A]].
    - assert (B : quad radial (add (sub y c) (sub p y)) <= ((opening + rim) * k + gap * k) * ((opening + rim) * k + gap * k)).
      { apply quad_add_le; auto using radial_semidefinite; [apply Rmult_le_pos; lra | nra | nra]. }
      replace (add (sub y c) (sub p y)) with (sub p c) in B by (unfold add, sub; simpl; f_equal; ring).
      nra.
    - set (u := sqrt (quad radial (sub p c))).
      assert (U : u * u = quad radial (sub p c)) by (apply sqrt_sqrt, radial_semidefinite).
      assert (U0 : 0 <= u) by apply sqrt_pos.
      assert (B : quad radial (add (sub p c) (sub y p)) <= (u + gap * k) * (u + gap * k)).
      { apply quad_add_le; auto using radial_semidefinite; [lra|].
        replace (quad radial (sub y p)) with (quad radial (sub p y))
          by (unfold quad, form, dot, apply, sub; simpl; ring). nra. }
      replace (add (sub p c) (sub y p)) with (sub y c) in B by (unfold add, sub; simpl; f_equal; ring).
      assert (K : 0 <= (opening - gap) * k) by (apply Rmult_le_pos; lra).
      assert (W : - ((opening - gap) * k) < u < (opening - gap) * k) by (apply squares_lt; nra).
      assert (u + gap * k < opening * k) by lra. nra.
  Qed.

  (** The gaps are the sides of a right triangle; its longest side is the distance. *)
  Theorem rim_clear : forall p y up out length, dot n n <> 0 -> 0 <= up -> 0 <= out ->
    up * up + out * out = length * length -> 0 < length ->
    (up = 0 \/ ahead p up) -> (out = 0 \/ aside p out) -> in_rim y ->
    length * length < dot (sub p y) (sub p y).
  Proof.
    intros p y up out L NZ Hu Ho E HL A B R.
    pose proof (radial_form (sub p y)) as F; pose proof (dot_square n).
    assert (P : 0 < dot n n) by lra.
    assert (A' : up * up * dot n n <= dot n (sub p y) * dot n (sub p y)).
    { destruct A as [->|A]; [pose proof (square_nonneg (dot n (sub p y))); lra|].
      pose proof (ahead_apart p y up Hu A R); lra. }
    assert (B' : out * out * dot n n <= quad radial (sub p y)).
    { destruct B as [->|B]; [pose proof (radial_semidefinite (sub p y)); lra|].
      pose proof (aside_apart p y out Ho B R); lra. }
    assert (S : L * L * dot n n < dot n n * dot (sub p y) (sub p y)).
    { destruct A as [->|A].
      - destruct B as [->|B]; [nra|]; pose proof (aside_apart p y out Ho B R); nra.
      - pose proof (ahead_apart p y up Hu A R); nra. }
    nra.
  Qed.
End Hoop.

(** ** One passage

    Leaves in which the far side is not reached, leaves in which a path does not turn back,
    and leaves in which the near side is not reached: whoever was on the far side does not
    come to the near side again. *)
Theorem passes_once : forall (g : R -> R) far a b c d, 0 <= far ->
  (forall t, a <= t <= b -> g t <= far) ->
  (forall t u, b <= t -> t <= u -> u <= c -> g t <= g u) ->
  (forall t, c <= t <= d -> - far <= g t) ->
  forall t u, a <= t -> t <= u -> u <= d -> far < g t -> - far <= g u.
Proof.
  intros g far a b c d Hf Before Rises After t u Ha Htu Hd H.
  destruct (Rle_lt_dec t b) as [L|L]; [specialize (Before t); lra|].
  destruct (Rle_lt_dec c u) as [K|K]; [apply After; lra|].
  assert (g t <= g u) by (apply Rises; lra); lra.
Qed.
