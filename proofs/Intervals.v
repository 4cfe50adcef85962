(** Intervals whose ends are whole numbers over one unit: every result holds all that may come of the operands. *)

Require Import Reals Lra Lia ZArith Psatz Bool.
Open Scope Z_scope.

Record interval := Interval { low : Z; high : Z }.

Section Intervals.
  (** Ends are whole numbers over [unit]. *)
  Variable unit : Z.

  (** *** The operations *)

  Definition floor_over (n d : Z) : Z := n / d.
  Definition ceiling_over (n d : Z) : Z := - (- n / d).

  (** The least interval that holds n / d. *)
  Definition of (n d : Z) : interval := Interval (floor_over (n * unit) d) (ceiling_over (n * unit) d).

  Definition plus (i j : interval) : interval := Interval (low i + low j) (high i + high j).
  Definition minus (i j : interval) : interval := Interval (low i - high j) (high i - low j).
  Definition opposite (i : interval) : interval := Interval (- high i) (- low i).

  Definition least (a b c d : Z) : Z := Z.min (Z.min a b) (Z.min c d).
  Definition greatest (a b c d : Z) : Z := Z.max (Z.max a b) (Z.max c d).

  Definition times (i j : interval) : interval :=
    let a := low i * low j in let b := low i * high j in
    let c := high i * low j in let d := high i * high j in
    Interval (floor_over (least a b c d) unit) (ceiling_over (greatest a b c d) unit).

  (** Nothing where a divisor may be zero. *)
  Definition over (i j : interval) : option interval :=
    if (low j <=? 0) && (0 <=? high j) then None
    else
      let q f n d := f (n * unit) d in
      Some (Interval
        (least (q floor_over (low i) (low j)) (q floor_over (low i) (high j))
               (q floor_over (high i) (low j)) (q floor_over (high i) (high j)))
        (greatest (q ceiling_over (low i) (low j)) (q ceiling_over (low i) (high j))
                  (q ceiling_over (high i) (low j)) (q ceiling_over (high i) (high j)))).

  Definition squared (i : interval) : interval :=
    let a := low i * low i in let b := high i * high i in
    Interval (floor_over (if (low i <=? 0) && (0 <=? high i) then 0 else Z.min a b) unit)
             (ceiling_over (Z.max a b) unit).

  Definition root (i : interval) : interval :=
    Interval (Z.sqrt (Z.max (low i) 0 * unit)) (Z.sqrt (Z.max (high i) 0 * unit) + 1).

  (** All of it lies between n / d and n' / d'. *)
  Definition within (i : interval) (n d n' d' : Z) : bool :=
    (n * unit <=? low i * d) && (high i * d' <=? n' * unit).

  (** *** Their soundness *)

  Hypothesis unit_positive : 0 < unit.
  Open Scope R_scope.

  Definition contains (i : interval) (x : R) : Prop := IZR (low i) <= x * IZR unit <= IZR (high i).

  Lemma unit_real : 0 < IZR unit.
  Proof. apply IZR_lt; auto. Qed.

  Lemma floor_below : forall n d, d <> 0%Z -> IZR (floor_over n d) <= IZR n / IZR d.
  Proof.
    intros n d H; unfold floor_over.
    assert (E : IZR n = IZR d * IZR (n / d) + IZR (n mod d))
      by (rewrite <- mult_IZR, <- plus_IZR; f_equal; apply Z.div_mod; auto).
    assert (D : IZR d <> 0) by (apply not_0_IZR; auto).
    rewrite E; replace ((IZR d * IZR (n / d) + IZR (n mod d)) / IZR d)
      with (IZR (n / d) + IZR (n mod d) / IZR d) by (field; auto).
    assert (0 <= IZR (n mod d) / IZR d); [|lra].
    destruct (Z_lt_le_dec 0 d) as [P|P].
    - apply Rmult_le_pos; [apply IZR_le; pose proof (Z.mod_pos_bound n d P); lia|].
      apply Rlt_le, Rinv_0_lt_compat, IZR_lt; auto.
    - assert (N : (d < 0)%Z) by lia; pose proof (Z.mod_neg_bound n d N).
      assert (M : IZR (n mod d) <= 0) by (apply IZR_le; lia).
      assert (I : / IZR d < 0) by (apply Rinv_lt_0_compat, IZR_lt; auto).
      unfold Rdiv; nra.
  Qed.

  Lemma ceiling_above : forall n d, d <> 0%Z -> IZR n / IZR d <= IZR (ceiling_over n d).
  Proof.
    intros n d H; unfold ceiling_over; pose proof (floor_below (- n) d H) as F; unfold floor_over in F.
    rewrite opp_IZR in F |- *; replace (- IZR n / IZR d) with (- (IZR n / IZR d)) in F by (field; apply not_0_IZR; auto).
    lra.
  Qed.

  Theorem of_sound : forall n d, (0 < d)%Z -> contains (of n d) (IZR n / IZR d).
  Proof.
    intros n d H; unfold contains, of; cbn [low high].
    assert (D : IZR d <> 0) by (apply not_0_IZR; lia).
    replace (IZR n / IZR d * IZR unit) with (IZR (n * unit) / IZR d) by (rewrite mult_IZR; field; auto).
    split; [apply floor_below | apply ceiling_above]; lia.
  Qed.

  Theorem plus_sound : forall i j x y, contains i x -> contains j y -> contains (plus i j) (x + y).
  Proof. intros i j x y [A B] [C D]; unfold contains, plus; cbn; rewrite !plus_IZR; lra. Qed.

  Theorem minus_sound : forall i j x y, contains i x -> contains j y -> contains (minus i j) (x - y).
  Proof. intros i j x y [A B] [C D]; unfold contains, minus; cbn; rewrite !minus_IZR; lra. Qed.

  Theorem opposite_sound : forall i x, contains i x -> contains (opposite i) (- x).
  Proof. intros i x [A B]; unfold contains, opposite; cbn; rewrite !opp_IZR; lra. Qed.

  (** A product is nowhere below the least of the four of the ends, nor above the greatest. *)
  Lemma product_above : forall a b c d x y k, a <= x <= b -> c <= y <= d ->
    k <= a * c -> k <= a * d -> k <= b * c -> k <= b * d -> k <= x * y.
  Proof.
    intros a b c d x y k X Y H1 H2 H3 H4.
    assert (A : k <= a * y) by (destruct (Rle_lt_dec 0 a); nra).
    assert (B : k <= b * y) by (destruct (Rle_lt_dec 0 b); nra).
    destruct (Rle_lt_dec 0 y); nra.
  Qed.

  Lemma product_below : forall a b c d x y k, a <= x <= b -> c <= y <= d ->
    a * c <= k -> a * d <= k -> b * c <= k -> b * d <= k -> x * y <= k.
  Proof.
    intros a b c d x y k X Y H1 H2 H3 H4.
    pose proof (product_above (- b) (- a) c d (- x) y (- k)); lra.
  Qed.

  Lemma least_all : forall a b c d, (least a b c d <= a /\ least a b c d <= b /\ least a b c d <= c /\ least a b c d <= d)%Z.
  Proof. intros; unfold least; lia. Qed.
  Lemma greatest_all : forall a b c d,
    (a <= greatest a b c d /\ b <= greatest a b c d /\ c <= greatest a b c d /\ d <= greatest a b c d)%Z.
  Proof. intros; unfold greatest; lia. Qed.

  Lemma scaled : forall x k l, IZR k / IZR unit <= x -> x <= IZR l / IZR unit ->
    IZR k <= x * IZR unit <= IZR l.
  Proof.
    intros x k l K L; pose proof unit_real; split.
    - apply Rmult_le_compat_r with (r := IZR unit) in K; [|lra].
      replace (IZR k / IZR unit * IZR unit) with (IZR k) in K by (field; lra); auto.
    - apply Rmult_le_compat_r with (r := IZR unit) in L; [|lra].
      replace (IZR l / IZR unit * IZR unit) with (IZR l) in L by (field; lra); auto.
  Qed.

  (** From a product of scaled numbers to the interval of the product. *)
  Lemma rounded : forall k l x, IZR k <= x * IZR unit * IZR unit <= IZR l ->
    contains (Interval (floor_over k unit) (ceiling_over l unit)) x.
  Proof.
    intros k l x [K L]; unfold contains; cbn; pose proof unit_real.
    assert (N : unit <> 0%Z) by lia.
    pose proof (floor_below k unit N) as F; pose proof (ceiling_above l unit N) as C.
    assert (IZR k / IZR unit <= x * IZR unit).
    { apply Rmult_le_reg_r with (IZR unit); auto; replace (IZR k / IZR unit * IZR unit) with (IZR k) by (field; lra); lra. }
    assert (x * IZR unit <= IZR l / IZR unit).
    { apply Rmult_le_reg_r with (IZR unit); auto; replace (IZR l / IZR unit * IZR unit) with (IZR l) by (field; lra); lra. }
    lra.
  Qed.

  Theorem times_sound : forall i j x y, contains i x -> contains j y -> contains (times i j) (x * y).
  Proof.
    intros i j x y X Y; apply rounded.
    replace (x * y * IZR unit * IZR unit) with ((x * IZR unit) * (y * IZR unit)) by ring.
    pose proof (least_all (low i * low j) (low i * high j) (high i * low j) (high i * high j)) as (A1 & A2 & A3 & A4).
    pose proof (greatest_all (low i * low j) (low i * high j) (high i * low j) (high i * high j)) as (B1 & B2 & B3 & B4).
    apply IZR_le in A1, A2, A3, A4, B1, B2, B3, B4; rewrite mult_IZR in *.
    split; [eapply product_above | eapply product_below]; eauto.
  Qed.

  Lemma inverse_falls : forall u v, u <= v -> v < 0 -> / v <= / u.
  Proof.
    intros u v L N; assert (I : / - u <= / - v) by (apply Rinv_le_contravar; lra).
    replace (/ - u) with (- / u) in I by (field; lra); replace (/ - v) with (- / v) in I by (field; lra); lra.
  Qed.

  Theorem over_sound : forall i j k x y, over i j = Some k -> contains i x -> contains j y ->
    y <> 0 /\ contains k (x / y).
  Proof.
    intros i j k x y O X Y; unfold over in O.
    destruct ((low j <=? 0)%Z && (0 <=? high j)%Z) eqn:E; [discriminate|]; injection O as <-.
    pose proof unit_real as U; set (s := y * IZR unit) in *.
    assert (C : (0 < low j \/ high j < 0)%Z).
    { apply andb_false_iff in E as [E|E]; [left | right]; apply Z.leb_gt in E; auto. }
    assert (NL : low j <> 0%Z /\ high j <> 0%Z /\ (low j <= high j)%Z).
    { destruct Y as [Y1 Y2]; assert (IZR (low j) <= IZR (high j)) by lra.
      apply le_IZR in H; destruct C; lia. }
    destruct NL as (NL & NH & LH).
    assert (I : / IZR (high j) <= / s <= / IZR (low j)).
    { destruct Y as [Y1 Y2]; fold s in Y1, Y2; destruct C as [C|C]; apply IZR_lt in C.
      - split; apply Rinv_le_contravar; lra.
      - split; apply inverse_falls; lra. }
    assert (S : s <> 0) by (destruct Y as [Y1 Y2]; fold s in Y1, Y2; destruct C as [C|C]; apply IZR_lt in C; lra).
    assert (Ny : y <> 0) by (intros ->; apply S; unfold s; ring).
    split; auto; unfold contains; cbn [low high].
    replace (x / y * IZR unit) with ((x * IZR unit) * IZR unit * / s) by (unfold s; field; split; auto; lra).
    assert (Q : forall n d, d <> 0%Z -> IZR (n * unit) / IZR d = IZR n * IZR unit * / IZR d)
      by (intros; rewrite mult_IZR; auto).
    assert (F : forall n d, d <> 0%Z -> IZR (floor_over (n * unit) d) <= IZR n * IZR unit * / IZR d
      /\ IZR n * IZR unit * / IZR d <= IZR (ceiling_over (n * unit) d)).
    { intros n d D; rewrite <- Q by auto; split; [apply floor_below | apply ceiling_above]; auto. }
    destruct X as [X1 X2].
    assert (X' : IZR (low i) * IZR unit <= x * IZR unit * IZR unit <= IZR (high i) * IZR unit)
      by (split; apply Rmult_le_compat_r; lra).
    destruct (F (low i) (low j) NL), (F (low i) (high j) NH), (F (high i) (low j) NL), (F (high i) (high j) NH).
    split.
    - match goal with |- IZR (least ?a ?b ?c ?d) <= _ => pose proof (least_all a b c d) as (A1 & A2 & A3 & A4) end.
      apply IZR_le in A1, A2, A3, A4.
      apply (product_above _ _ _ _ _ _ _ X' I); lra.
    - match goal with |- _ <= IZR (greatest ?a ?b ?c ?d) => pose proof (greatest_all a b c d) as (A1 & A2 & A3 & A4) end.
      apply IZR_le in A1, A2, A3, A4.
      apply (product_below _ _ _ _ _ _ _ X' I); lra.
  Qed.

  Theorem squared_sound : forall i x, contains i x -> contains (squared i) (x * x).
  Proof.
    intros i x [A B]; apply rounded.
    replace (x * x * IZR unit * IZR unit) with ((x * IZR unit) * (x * IZR unit)) by ring.
    set (s := x * IZR unit) in *; split.
    - destruct ((low i <=? 0)%Z && (0 <=? high i)%Z) eqn:E; [pose proof (Rle_0_sqr s); unfold Rsqr in *; lra|].
      assert (C : (0 < low i \/ high i < 0)%Z).
      { apply andb_false_iff in E as [E|E]; [left | right]; apply Z.leb_gt in E; auto. }
      pose proof (Z.le_min_l (low i * low i) (high i * high i)) as L1.
      pose proof (Z.le_min_r (low i * low i) (high i * high i)) as L2.
      apply IZR_le in L1, L2; rewrite mult_IZR in L1, L2.
      destruct C as [C|C]; apply IZR_lt in C; nra.
    - pose proof (Z.le_max_l (low i * low i) (high i * high i)) as L1.
      pose proof (Z.le_max_r (low i * low i) (high i * high i)) as L2.
      apply IZR_le in L1, L2; rewrite mult_IZR in L1, L2.
      destruct (Rle_lt_dec 0 s); nra.
  Qed.

  Theorem root_sound : forall i x, 0 <= x -> contains i x -> contains (root i) (sqrt x).
  Proof.
    intros i x Hx [A B]; unfold contains, root; cbn [low high]; pose proof unit_real as U.
    pose proof (sqrt_pos x) as S; assert (E : sqrt x * sqrt x = x) by (apply sqrt_sqrt; auto).
    set (r := sqrt x) in *; assert (P : 0 <= r * IZR unit) by (apply Rmult_le_pos; lra).
    assert (Q : (r * IZR unit) * (r * IZR unit) = x * IZR unit * IZR unit) by (rewrite <- E; ring).
    split.
    - set (z := (Z.max (low i) 0 * unit)%Z); assert (Z0 : (0 <= z)%Z) by (unfold z; nia).
      destruct (Z.sqrt_spec z Z0) as [L _]; pose proof (Z.sqrt_nonneg z) as K.
      apply IZR_le in L, K; rewrite mult_IZR in L.
      assert (IZR z <= x * IZR unit * IZR unit).
      { unfold z; rewrite mult_IZR; apply Rmult_le_compat_r; [lra|].
        destruct (Z.max_spec (low i) 0) as [[_ ->]|[_ ->]]; auto. apply Rmult_le_pos; lra. }
      nra.
    - set (z := (Z.max (high i) 0 * unit)%Z); assert (Z0 : (0 <= z)%Z) by (unfold z; nia).
      destruct (Z.sqrt_spec z Z0) as [_ L]; pose proof (Z.sqrt_nonneg z) as K.
      apply IZR_lt in L; apply IZR_le in K; rewrite mult_IZR, succ_IZR in L.
      assert (x * IZR unit * IZR unit <= IZR z).
      { unfold z; rewrite mult_IZR; apply Rmult_le_compat_r; [lra|].
        apply Rle_trans with (1 := B), IZR_le; lia. }
      rewrite plus_IZR; apply Rnot_lt_le; intros N; nra.
  Qed.

  Theorem within_sound : forall i n d n' d' x, within i n d n' d' = true -> (0 < d)%Z -> (0 < d')%Z ->
    contains i x -> IZR n / IZR d <= x <= IZR n' / IZR d'.
  Proof.
    intros i n d n' d' x H D D' [A B]; pose proof unit_real as U.
    apply andb_prop in H as [H1 H2]; apply Z.leb_le, IZR_le in H1; apply Z.leb_le, IZR_le in H2.
    rewrite !mult_IZR in H1, H2; apply IZR_lt in D, D'; split.
    - apply Rmult_le_reg_r with (IZR d); auto; replace (IZR n / IZR d * IZR d) with (IZR n) by (field; lra).
      apply Rmult_le_reg_r with (IZR unit); auto; nra.
    - apply Rmult_le_reg_r with (IZR d'); auto; replace (IZR n' / IZR d' * IZR d') with (IZR n') by (field; lra).
      apply Rmult_le_reg_r with (IZR unit); auto; nra.
  Qed.
End Intervals.
